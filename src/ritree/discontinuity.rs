//! What is interpolated in a cell whose corners do not fit together: beside a discontinuity, or where directions turn fast
//! (§2.5).

use super::Parameters;
use super::attribute::{Attribute, Sampling};
use super::cell::{Kind, Place, Reason};
use super::interpolant::{Corners, Simplex, has_simplex, linear_weights};
use crate::geometry::Real;

impl Place {
    /// How a final cell answers whose corners do not fit together, `why` not. They are finished if some of them may.
    pub(super) fn parted<A: Attribute>(
        &self,
        attribute: &A,
        corners: &mut Corners<A::Output>,
        why: Reason,
        parameters: &Parameters,
    ) -> Kind {
        let sides = sides(attribute, corners);
        let is_defined = |side: &[usize]| linear_weights(side, [A::Real::of(0.5); 4]).is_some();
        let may_be_located = sides.iter().any(|&class| is_defined(&side(attribute, corners, class)));
        let Sampling { parts, tells_joined, .. } = attribute.sampling();
        // Where no discontinuity is, simplices differ only in how far directions are apart.
        let is_one_part = why == Reason::Angle && tells_joined && self.are_joined(attribute, corners, 0..16);
        let by_simplices = parts || is_one_part;
        let may_hold_simplex =
            by_simplices && holds_simplex(attribute, corners, |c| attribute.outline_class(c));
        if !may_be_located && !may_hold_simplex {
            return Kind::Traced(why);
        }
        self.finish(attribute, corners);
        if is_one_part && !parts {
            let is_one_class = Classes::of(corners, |c| attribute.class(c)).reason().is_none();
            return if is_one_class { Kind::Parted((), why) } else { Kind::Traced(why) };
        }
        let usable = |&class: &u32| usable(attribute, corners, class, parameters).ok();
        let located: Vec<_> = sides.iter().filter_map(usable).filter(|side| is_defined(side)).collect();
        let are_joined = |side: &Vec<usize>| self.are_joined(attribute, corners, side.iter().copied());
        if !located.is_empty() && located.iter().all(are_joined) {
            Kind::TwoClasses(())
        } else if by_simplices && holds_simplex(attribute, corners, |c| attribute.class(c)) {
            Kind::Parted((), why)
        } else {
            Kind::Traced(why)
        }
    }

    /// The output of a line of a cell whose corners do not fit together, by a simplex around it whose corners do. `None` if there
    /// is none.
    pub(super) fn of_simplex<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        stuv: [f64; 4],
        parameters: &Parameters,
    ) -> Option<A::Output> {
        let fits = |simplex: &Simplex<A::Real>| {
            let [first, rest @ ..] = simplex.corners().map(|bits| &corners[bits]);
            is_hit(attribute, first)
                && rest.iter().all(|c| attribute.class(c) == attribute.class(first))
                && !spread_exceeds(
                    attribute,
                    rest.into_iter().chain([first]),
                    parameters.angular_threshold_deg,
                )
        };
        let fractions = self.cell.fractions(&stuv.map(A::Real::of));
        Simplex::all_around(fractions).find(fits).map(|simplex| simplex.interpolated(attribute, corners))
    }

    /// Whether the outputs of some corners, which hit and are of one class, lie side by side: all beside the first.
    pub(super) fn are_joined<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        some: impl IntoIterator<Item = usize>,
    ) -> bool {
        let mut some = some.into_iter();
        let Some(first) = some.next() else { return true };
        let line = self.corner(first);
        some.all(|bits| attribute.are_joined([line, self.corner(bits)], [&corners[first], &corners[bits]]))
    }

    /// The output of a line of a cell of two classes, interpolated from samples of its own, or why it is traced.
    pub(super) fn of_own_class<A: Attribute>(
        &self,
        attribute: &A,
        corners: &Corners<A::Output>,
        stuv: [f64; 4],
        parameters: &Parameters,
    ) -> Result<A::Output, Reason> {
        let outline = attribute.locate(self.line(stuv));
        let class = attribute.outline_class(&outline);
        if attribute.is_miss(class) {
            return Ok(outline);
        }
        let side = usable(attribute, corners, class, parameters)?;
        let fractions = self.cell.fractions(&stuv.map(A::Real::of));
        let weights = linear_weights(&side, fractions).ok_or(Reason::Silhouette)?;
        let part = |(&bits, weight)| (weight, &corners[bits]);
        let parts: Vec<_> = side.iter().zip(weights).map(part).collect();
        Ok(attribute.told(&outline, attribute.interpolate(&parts)))
    }
}

/// The classes of a cell's corners.
pub enum Classes {
    /// They are of one.
    One,
    /// They are of these two.
    Two([u32; 2]),
    /// They are of three or more.
    More,
}

impl Classes {
    /// Those that `class_of` says.
    pub fn of<T>(corners: &Corners<T>, class_of: impl Fn(&T) -> u32) -> Self {
        let first = class_of(&corners[0]);
        let Some(other) = corners.iter().map(&class_of).find(|&c| c != first) else { return Self::One };
        let is_third = |c: u32| c != first && c != other;
        if corners.iter().map(class_of).any(is_third) { Self::More } else { Self::Two([first, other]) }
    }

    /// Why nothing is interpolated between all of them. `None` if it may be.
    pub fn reason(&self) -> Option<Reason> {
        match self {
            Self::One => None,
            Self::Two(_) => Some(Reason::Silhouette),
            Self::More => Some(Reason::Classes),
        }
    }
}

/// The classes on the sides of the one discontinuity of outlines that a line can be located at, misses apart.
fn sides<A: Attribute>(attribute: &A, corners: &Corners<A::Output>) -> Vec<u32> {
    match Classes::of(corners, |c| attribute.outline_class(c)) {
        Classes::Two(both) if attribute.locates() => {
            both.into_iter().filter(|&class| !attribute.is_miss(class)).collect()
        }
        _ => Vec::new(),
    }
}

/// The corners on one side of a discontinuity: those whose outlines are of a class.
fn side<A: Attribute>(attribute: &A, corners: &Corners<A::Output>, class: u32) -> Vec<usize> {
    (0..16).filter(|&bits| attribute.outline_class(&corners[bits]) == class).collect()
}

/// The corners on one side, if they are of one class in all and their directions within the threshold, or why not.
fn usable<A: Attribute>(
    attribute: &A,
    corners: &Corners<A::Output>,
    class: u32,
    parameters: &Parameters,
) -> Result<Vec<usize>, Reason> {
    let side = side(attribute, corners, class);
    let whole = |bits: usize| attribute.class(&corners[bits]);
    if side.iter().any(|&bits| whole(bits) != whole(side[0])) {
        return Err(Reason::Classes);
    }
    if spread_exceeds(attribute, side.iter().map(|&bits| &corners[bits]), parameters.angular_threshold_deg) {
        return Err(Reason::Angle);
    }
    Ok(side)
}

fn is_hit<A: Attribute>(attribute: &A, output: &A::Output) -> bool {
    !attribute.is_miss(attribute.outline_class(output))
}

/// Whether there is a simplex whose corners all hit and are of one class.
fn holds_simplex<A: Attribute>(
    attribute: &A,
    corners: &Corners<A::Output>,
    class_of: impl Fn(&A::Output) -> u32,
) -> bool {
    has_simplex(|bits| is_hit(attribute, &corners[bits]).then(|| class_of(&corners[bits])))
}

/// Whether two of the outputs' directions differ by more than the threshold.
pub fn spread_exceeds<'a, A: Attribute>(
    attribute: &A,
    outputs: impl Iterator<Item = &'a A::Output>,
    threshold_deg: f64,
) -> bool
where
    A::Output: 'a,
{
    let directions: Vec<_> = outputs.filter_map(|o| attribute.direction(o)).collect();
    let threshold = (attribute.angular_share() * threshold_deg).to_radians();
    let cosine = |angle: f64| A::Real::of(angle.cos());
    // All within half of it of one of them are within it of each other.
    let near = cosine(0.5 * threshold);
    if directions.iter().all(|a| a.dot(directions[0]) >= near) {
        return false;
    }
    let least = cosine(threshold);
    directions.iter().enumerate().any(|(i, a)| directions[..i].iter().any(|b| a.dot(*b) < least))
}
