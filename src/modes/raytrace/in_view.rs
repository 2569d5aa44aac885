//! Which objects a pixel may show: those whose silhouettes hold it (item buffers, Weghorst, Hooper & Greenberg 1984,
//! doi:10.1145/357332.357335).
//!
//! What a pixel shows in a flat mirror is what it would show of the mirrored camera, so that objects have silhouettes as seen from
//! there as well. Exact tracing and trees both hold rays against these objects alone, and it takes them no operation.

use super::silhouette::Silhouette;
use crate::geometry::{Bounds, Region};
use crate::scene::trace::{Camera, Object};
use crate::surface::Surface;
use crate::surface::optics::Optics;

/// Objects and where in the picture they may be seen, in the order in which rays are held against them.
type Visible = Vec<(u32, Silhouette)>;

/// So many flat mirrors have silhouettes of their own; whatever is seen in others may be anywhere.
const MOST_MIRRORS: usize = 4;

/// Where in a picture, or on a part of it, objects may be seen.
pub struct InView {
    /// By rays that come from anywhere.
    anyhow: Visible,
    straight: Visible,
    /// In flat mirrors, by the mirror's index.
    mirrored: Vec<(u32, Visible)>,
}

impl InView {
    /// In the whole picture: objects and their boxes, in an order.
    pub fn new(
        camera: &Camera,
        size: (u32, u32),
        objects: &[Object],
        boxes: &[Bounds],
        order: &[u32],
    ) -> Self {
        let seen_by = |camera: &Camera| {
            let silhouette = |&i: &u32| {
                Some((i, Silhouette::new(&objects[i as usize].surface, &boxes[i as usize], camera, size)?))
            };
            order.iter().filter_map(silhouette).collect()
        };
        let in_mirror = |&mirror: &u32| {
            let Object { surface: Surface::Disc(disc), material, .. } = &objects[mirror as usize] else {
                return None;
            };
            let is_mirror = material.optics() == Some(Optics::Mirror);
            let image = is_mirror.then(|| camera.mirrored(|p| disc.mirrored(p), |w| disc.mirrored_way(w)))?;
            Some((mirror, seen_by(&image)))
        };
        Self {
            anyhow: order.iter().map(|&index| (index, Silhouette::ANYWHERE)).collect(),
            straight: seen_by(camera),
            mirrored: order.iter().filter_map(in_mirror).take(MOST_MIRRORS).collect(),
        }
    }

    /// On a tile of it.
    pub fn on(&self, tile: &Region) -> Self {
        let reach = |seen: &Visible| {
            seen.iter().filter(|(_, silhouette)| silhouette.reaches(tile)).cloned().collect()
        };
        Self {
            anyhow: self.anyhow.clone(),
            straight: reach(&self.straight),
            mirrored: self.mirrored.iter().map(|(mirror, seen)| (*mirror, reach(seen))).collect(),
        }
    }

    /// By rays that come from anywhere.
    pub fn anyhow(&self) -> &[(u32, Silhouette)] {
        &self.anyhow
    }

    /// By rays from the camera.
    pub fn straight(&self) -> &[(u32, Silhouette)] {
        &self.straight
    }

    /// By rays from the camera that an object mirrored. `None` if that is not known.
    pub fn mirrored_by(&self, object: usize) -> Option<&[(u32, Silhouette)]> {
        let of_mirror = self.mirrored.iter().find(|(index, _)| *index as usize == object);
        of_mirror.map(|(_, visible)| &visible[..])
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::geometry::Ray;
    use crate::scene::trace::{Recipe, open};
    use crate::surface::optics::reflected;
    use crate::surface::{Disc, Reach, Sphere};

    #[test]
    fn whatever_a_pixel_shows_is_in_view_there() {
        let world = open("tomatoes", Recipe { seed: 1, count: 1 }).expect("a world");
        let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
        let mut vector = |scale: f64| DVec3::from([(); 3].map(|()| rng.random_range(-scale..scale)));
        let like = |surface| Object { surface, ..world.objects[0].clone() };
        let mirror =
            Disc::new(DVec3::new(3.0, -8.0, -20.0), DVec3::new(0.3, 0.1, 1.0), 300.0).expect("a disc");
        let mut objects = vec![like(Surface::Disc(mirror))];
        let ball = |i: u32| Sphere::new(vector(100.0), 1.0 + f64::from(i)).expect("a sphere");
        objects.extend((0..30).map(ball).map(|ball| like(Surface::Sphere(ball))));
        // A bowl, a sheet and a tomato, whose parts are told apart.
        objects.extend([1, 6, 7].map(|index| like(world.objects[index].surface.clone())));
        let boxes: Vec<Bounds> = objects.iter().map(|object| object.surface.bounds()).collect();
        let order: Vec<u32> = (0..objects.len() as u32).rev().collect();
        let (size, mut met, mut held, mut all) = ((40, 30), [0; 2], 0, 0);
        // From outside, from among them, and from within one.
        for eye in [DVec3::new(200.0, -200.0, 90.0), DVec3::ONE, boxes[30].centre()] {
            let camera = Camera::new(eye, DVec3::splat(0.5), DVec3::Z, 50.0).expect("a camera");
            let whole = InView::new(&camera, size, &objects, &boxes, &order);
            let mut rays = camera.rays::<f64>(size);
            for (column, row) in (0..40).flat_map(|x| (0..30).map(move |y| (x, y))) {
                let in_view = whole.on(&Region { columns: column..column + 1, rows: row..row + 1 });
                let place = [f64::from(column) + 0.3, f64::from(row) + 0.9];
                let ray = rays.through(place);
                let mut hold = |ray: &Ray<f64>, seen: &[(u32, Silhouette)], mirror: Option<usize>| {
                    for (index, object) in objects.iter().enumerate().filter(|(i, _)| Some(*i) != mirror) {
                        let is_met = object.surface.hit(ray, Reach::whole()).is_some();
                        let mut at_place = seen.iter().filter(|(_, silhouette)| silhouette.holds(place));
                        met[usize::from(mirror.is_some())] += usize::from(is_met);
                        let is_seen = at_place.any(|(i, _)| *i as usize == index);
                        assert!(
                            !is_met || is_seen,
                            "{index} from {eye} at {place:?}, mirrored by {mirror:?}"
                        );
                        held += usize::from(is_seen);
                        all += 1;
                    }
                };
                hold(&ray, in_view.straight(), None);
                if let Some(hit) = mirror.hit(&ray, Reach::whole()) {
                    let on = Ray { origin: hit.place(&ray), dir: reflected(ray.dir, hit.normal) };
                    hold(&on, in_view.mirrored_by(0).expect("a mirror"), Some(0));
                }
                assert!(in_view.mirrored_by(1).is_none() && in_view.anyhow().len() == objects.len());
            }
        }
        assert!(met[0] > 2_000 && met[1] > 500 && held < all / 3, "{met:?} met, {held} held of {all}");
    }
}
