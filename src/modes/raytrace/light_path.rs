//! Light on its way back to the camera: what a ray meets, how that is lit, and which rays go on from there.

use std::cell::LazyCell;

use super::in_view::InView;
use super::seer::{Asker, Seer, Sight};
use super::{Renderer, Work};
use crate::geometry::{Ray, Real, Vec3};
use crate::scene::trace::{Camera, SkyFrom};
use crate::surface::optics::{reflectance, reflected};
use crate::surface::{Reach, Slabs};

/// Follows the rays of one tile.
pub struct LightPath<'t, 'a, R: Real> {
    renderer: &'t Renderer<'a, R>,
    seers: &'t [Seer<'a, R>],
    askers: Vec<Asker<'t, 'a, R>>,
    /// What the tile may show, and the place of the picture that light now comes to, pixels.
    in_view: &'t InView,
    place: [f64; 2],
    /// The sky as the camera sees it.
    sky_from_eye: SkyFrom<R>,
    /// What the rays have taken so far.
    pub work: Work,
    /// Whether an object with a tree was traced.
    pub was_traced: bool,
}

/// How near to each other the rays of neighbouring pixels run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bundle {
    /// As they left the camera: neighbours ask the same cells.
    FromEye,
    /// Mirrored, but at planes only, as if they came from one of the camera's images: by this flat mirror, or by more than one.
    FromImage(Option<usize>),
    /// Turned by what is curved. They scatter over line space, and the cells that a few of them would share cost more than tracing
    /// them.
    Scattered,
}

/// Light that would change a pixel by less than this, a quarter of the least step of eight bits, is not followed.
const LEAST_SHARE: f64 = 1e-3;

impl<'t, 'a, R: Real> LightPath<'t, 'a, R> {
    /// For rays of a camera through the pixels of a tile.
    pub fn new(
        renderer: &'t Renderer<'a, R>,
        seers: &'t [Seer<'a, R>],
        camera: &Camera,
        in_view: &'t InView,
    ) -> Self {
        Self {
            renderer,
            seers,
            askers: seers.iter().map(|seer| seer.asker(camera.eye())).collect(),
            in_view,
            place: [0.0; 2],
            sky_from_eye: renderer.world.sky.from(Vec3::of(camera.eye())),
            work: Work::default(),
            was_traced: false,
        }
    }

    /// The light that comes to the camera along the ray through a place of the picture.
    pub fn seen(&mut self, ray: &Ray<R>, place: [f64; 2]) -> Vec3<R> {
        self.place = place;
        self.radiance(ray, R::of(1.0), None, 0, Bundle::FromEye)
    }

    /// The light that comes along a ray; it makes up `share` of a pixel's. The object that the ray has `left` is not met
    /// again: mirrors and glass bodies let rays go only when they leave for good, and what a clear sheet has of itself
    /// behind it is not seen through it.
    fn radiance(
        &mut self,
        ray: &Ray<R>,
        share: R,
        left: Option<usize>,
        turns: u32,
        bundle: Bundle,
    ) -> Vec3<R> {
        self.work.rays += 1;
        let Some((object, sight)) = self.nearest(ray, left, bundle) else {
            let place = match bundle {
                Bundle::FromEye => self.sky_from_eye.place(ray.dir),
                Bundle::FromImage(_) | Bundle::Scattered => {
                    self.renderer.world.sky.from(ray.origin).place(ray.dir)
                }
            };
            return self.renderer.sky.colour_at(place);
        };
        let seer = &self.seers[object];
        let material = seer.material();
        let mut light = self.shade(object, ray, &sight);
        if turns >= self.renderer.world.most_turns {
            return light;
        }
        let is_worth = |part: R| (share * part).get() > LEAST_SHARE;
        let clear = R::of(material.clear);
        if is_worth(clear) {
            let on = Ray { origin: sight.place, dir: ray.dir };
            light = light + self.radiance(&on, share * clear, Some(object), turns + 1, bundle) * clear;
        }
        if let Some(glass) = material.glass
            && material.mirror > 0.0
            && seer.object.is_convex
        {
            // What a glass body mirrors outside, by Fresnel's share; inside, it is given up.
            let part =
                reflectance(-ray.dir.dot(sight.normal), R::of(1.0 / glass.index)) * R::of(material.mirror);
            if is_worth(part) {
                let dir = reflected(ray.dir, sight.normal);
                let on = Ray { origin: sight.place, dir };
                light = light
                    + self.radiance(&on, share * part, Some(object), turns + 1, Bundle::Scattered) * part;
            }
        }
        if let Some((on, inner_turns)) = seer.turned(ray, &sight) {
            let part = R::of(material.share(inner_turns));
            if is_worth(part) {
                let bundle = match bundle {
                    Bundle::FromEye if seer.is_flat() => Bundle::FromImage(Some(object)),
                    Bundle::FromImage(_) if seer.is_flat() => Bundle::FromImage(None),
                    _ => Bundle::Scattered,
                };
                light = light + self.radiance(&on, share * part, Some(object), turns + 1, bundle) * part;
            }
        }
        light
    }

    /// The nearest object along a ray.
    fn nearest(&mut self, ray: &Ray<R>, left: Option<usize>, bundle: Bundle) -> Option<(usize, Sight<R>)> {
        let in_view = self.in_view;
        let known = match bundle {
            Bundle::FromEye => Some(in_view.straight()),
            Bundle::FromImage(Some(mirror)) => in_view.mirrored_by(mirror),
            Bundle::FromImage(None) | Bundle::Scattered => None,
        };
        let (objects, is_known) = (known.unwrap_or(in_view.anyhow()), known.is_some());
        let place = self.place;
        let objects = objects.iter().filter(|(_, silhouette)| silhouette.holds(place));
        let slabs = LazyCell::new(|| Slabs::new(ray));
        let mut best: Option<(usize, Sight<R>)> = None;
        for index in objects.map(|(index, _)| *index as usize).filter(|&index| Some(index) != left) {
            let to = best.as_ref().map_or(R::of(f64::INFINITY), |(_, sight)| sight.t);
            let seer = &self.seers[index];
            // What is in view is mostly met: where a hit takes little more than a look at the box, that is left out.
            let sight = if is_known && !seer.has_tree() && seer.has_closed_form() {
                seer.trace(ray, Reach { to, ..Reach::whole() })
            } else {
                self.sight(index, ray, &slabs, to, bundle)
            };
            if let Some(sight) = sight {
                best = Some((index, sight));
            }
        }
        best
    }

    /// One object along a ray, not beyond `to`.
    fn sight(
        &mut self,
        index: usize,
        ray: &Ray<R>,
        slabs: &Slabs<R>,
        to: R,
        bundle: Bundle,
    ) -> Option<Sight<R>> {
        let seer = &self.seers[index];
        let (near, far) = slabs.stretch(&seer.bounds)?;
        if near > to || far.get() <= 0.0 {
            return None;
        }
        if seer.has_tree() {
            // The tree knows the first hit of the whole line: it serves where that lies ahead.
            if bundle != Bundle::Scattered && near.get() > 0.0 {
                self.work.queries += 1;
                if let Ok(answer) =
                    self.askers[index].ask(ray, bundle == Bundle::FromEye, &self.renderer.cache)
                {
                    self.work.interpolated += 1;
                    return answer.filter(|sight| sight.t <= to);
                }
            }
            self.work.traced += 1;
            self.was_traced = true;
        }
        seer.trace(ray, Reach { to, ..Reach::whole() })
    }

    /// What a place shows of the lights and of the sky's light.
    fn shade(&mut self, object: usize, ray: &Ray<R>, sight: &Sight<R>) -> Vec3<R> {
        let (world, seers) = (self.renderer.world, self.seers);
        let seer = &seers[object];
        let mut light = Vec3::of(seer.ambient);
        let material = seer.material();
        if material.is_dark() {
            return light;
        }
        let has_highlights = material.specular > 0.0;
        // Twice the cosine at which the ray comes.
        let comes = if has_highlights { R::of(2.0) * ray.dir.dot(sight.normal) } else { R::default() };
        for (index, lamp) in world.lights.iter().enumerate() {
            let way = Vec3::of(lamp.position) - sight.place;
            let facing = way.dot(sight.normal);
            if facing.get() <= 0.0 {
                continue;
            }
            let far = way.length();
            let over = R::of(1.0) / far;
            let cosine = facing * over;
            if seer.hides_itself(index, -way, ray, sight, cosine) {
                continue;
            }
            let reaching = self.visibility(object, index, sight.place, way, far);
            if reaching.get() <= 0.0 {
                continue;
            }
            light = light + Vec3::of(seer.scattered[index]) * (cosine * reaching);
            if has_highlights {
                // Of the mirrored ray and the way to the light.
                let towards = ray.dir.dot(way) * over - comes * cosine;
                if towards.get() > seer.highlight_from {
                    let strength = towards.powf(material.shininess) * R::of(material.specular) * reaching;
                    light = light + Vec3::of(lamp.colour) * strength;
                }
            }
        }
        light
    }

    /// The share of a light that reaches a place of an object through all others. The `way` from there to the light is `far`.
    fn visibility(&mut self, object: usize, light: usize, place: Vec3<R>, way: Vec3<R>, far: R) -> R {
        self.work.rays += 1;
        let mut share = R::of(1.0);
        let on_the_way = self.renderer.lights[light].towards(-way);
        if on_the_way.iter().all(|&index| index as usize == object) {
            return share;
        }
        let ray = LazyCell::new(|| Ray { origin: place, dir: way * (R::of(1.0) / far) });
        let slabs = LazyCell::new(|| Slabs::new(&ray));
        for index in on_the_way.iter().map(|&index| index as usize).filter(|&i| i != object) {
            let seer = &self.seers[index];
            let is_near = || slabs.entry(&seer.bounds, R::of(0.0), far).is_some();
            let is_met = || (seer.has_closed_form() || is_near()) && seer.is_met(&ray, far);
            if share.get() > 0.0 && seer.hides_by_map(light, -way).unwrap_or_else(is_met) {
                share = share * R::of(seer.material().translucence());
            }
        }
        share
    }
}
