//! Which way light goes on at a surface: mirrored, refracted, and out of an object at last.

use super::frame::steady_gap;
use super::{Crossing, Hit, Reach, Surface};
use crate::geometry::{Ray, Real, Vec3};

/// The direction mirrored at a surface of unit normal `normal`, from either side.
pub fn reflected<R: Real>(dir: Vec3<R>, normal: Vec3<R>) -> Vec3<R> {
    dir - normal * (R::of(2.0) * dir.dot(normal))
}

/// The direction refracted by Snell's law. `normal` is a unit vector against `dir`; `ratio` is the refractive index before
/// over the one behind. `None` where all light is reflected.
pub fn refracted<R: Real>(dir: Vec3<R>, normal: Vec3<R>, ratio: R) -> Option<Vec3<R>> {
    let cosine = -dir.dot(normal);
    let squared = R::of(1.0) - ratio * ratio * (R::of(1.0) - cosine * cosine);
    (squared.get() >= 0.0).then(|| (dir * ratio + normal * (ratio * cosine - squared.sqrt())).normalized())
}

/// The share of unpolarized light that is reflected where it could also be refracted (Fresnel); 1 where it could not.
/// `cosine` is that of the angle to the normal, `ratio` the index before over the one behind.
pub fn reflectance<R: Real>(cosine: R, ratio: R) -> R {
    let one = R::of(1.0);
    let squared = one - ratio * ratio * (one - cosine * cosine);
    if squared.get() <= 0.0 {
        return one;
    }
    let behind = squared.sqrt();
    let across = (ratio * cosine - behind) / (ratio * cosine + behind);
    let along = (cosine - ratio * behind) / (cosine + ratio * behind);
    R::of(0.5) * (across * across + along * along)
}

/// What an object does to rays that meet it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Optics {
    /// It mirrors them.
    Mirror,
    /// It lets them in and out, refracted, with total reflection inside: a body of this refractive index in a medium of
    /// index 1. The surface must be closed.
    Glass {
        /// The refractive index.
        index: f64,
    },
}

/// The way of a ray through one object: from its first hit to where it leaves for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path<R> {
    /// The first hit.
    pub hit: Hit<R>,
    /// The ray that leaves and meets the object no more. `None` if it was turned more often than the limit.
    pub exit: Option<Ray<R>>,
    /// How often it was turned: mirrored, refracted, or reflected inside.
    pub turns: u32,
    /// The class of the patch that it left from.
    pub last_class: u32,
}

/// Follows a ray that hits a surface first at `hit` until it leaves, through at most `limit` turns.
pub fn follow<R: Real>(surface: &Surface, ray: &Ray<R>, hit: Hit<R>, optics: Optics, limit: u32) -> Path<R> {
    let (mut ray, mut at, mut turns) = (*ray, hit, 0);
    loop {
        let against = if at.enters { at.normal } else { -at.normal };
        let (dir, crossing) = turned(ray.dir, against, at.enters, optics);
        let place = at.place(&ray);
        ray = Ray { origin: place, dir };
        turns += 1;
        // A ray in glass next leaves it, and one outside next enters it: not where it is, unless rounding says so.
        let from = R::of(steady_gap(at.error, dir.dot(at.normal).get()));
        let next = surface.hit(&ray, Reach { from, crossing, left: at.part, ..Reach::whole() });
        let last_class = at.class;
        match next {
            None => return Path { hit, exit: Some(ray), turns, last_class },
            Some(_) if turns >= limit => return Path { hit, exit: None, turns, last_class },
            Some(next) => at = next,
        }
    }
}

/// The direction after one turn, and which crossings can come next.
fn turned<R: Real>(dir: Vec3<R>, against: Vec3<R>, enters: bool, optics: Optics) -> (Vec3<R>, Crossing) {
    match optics {
        Optics::Mirror => (reflected(dir, against), Crossing::Any),
        Optics::Glass { index } => {
            let ratio = R::of(if enters { 1.0 / index } else { index });
            let next = if enters { Crossing::Leaving } else { Crossing::Entering };
            refracted(dir, against, ratio).map_or_else(
                // Thrown back on the side where it came from.
                || (reflected(dir, against), if enters { Crossing::Entering } else { Crossing::Leaving }),
                |dir| (dir, next),
            )
        }
    }
}
