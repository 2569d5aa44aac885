//! Light on its way back to the camera: what a ray meets, how that is lit, and which rays go on from there.

use super::Work;
use super::around::Around;
use super::seer::{Asker, Seer, Sight};
use super::sky_map::SkyMap;
use crate::geometry::{Ray, Real, Vec3};
use crate::ritree::Cache;
use crate::scene::trace::World;
use crate::surface::optics::{reflectance, reflected};
use crate::surface::{Reach, Slabs};

/// Follows the rays of one tile.
pub struct LightPath<'t, 'a, R: Real> {
    world: &'t World,
    sky: &'t SkyMap<'a>,
    /// Which objects lie where around the camera, and around each light.
    eye: &'t Around,
    lights: &'t [Around],
    seers: &'t [Seer<'a, R>],
    askers: Vec<Asker<'t, 'a, R>>,
    cache: &'t Cache,
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
    /// Mirrored, but at planes only, as if they came from the camera's images.
    FromImages,
    /// Turned by what is curved. They scatter over line space, and the cells that a few of them would share cost more than tracing
    /// them.
    Scattered,
}

/// Light that would change a pixel by less than this, a quarter of the least step of eight bits, is not followed.
const LEAST_SHARE: f64 = 1e-3;

impl<'t, 'a, R: Real> LightPath<'t, 'a, R> {
    /// For rays from the camera that `eye` lies around.
    pub fn new(
        world: &'t World,
        sky: &'t SkyMap<'a>,
        eye: &'t Around,
        lights: &'t [Around],
        seers: &'t [Seer<'a, R>],
        cache: &'t Cache,
    ) -> Self {
        Self {
            world,
            sky,
            eye,
            lights,
            seers,
            askers: seers.iter().map(Seer::asker).collect(),
            cache,
            work: Work::default(),
            was_traced: false,
        }
    }

    /// The light that comes to the camera along a ray.
    pub fn seen(&mut self, ray: &Ray<R>) -> Vec3<R> {
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
        let Some((object, sight)) = self.nearest(ray, left, bundle) else { return self.sky.seen(ray) };
        let seer = &self.seers[object];
        let material = seer.material();
        let mut light = self.shade(object, ray, &sight);
        if turns >= self.world.most_turns {
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
                    Bundle::FromEye | Bundle::FromImages if seer.is_flat() => Bundle::FromImages,
                    _ => Bundle::Scattered,
                };
                light = light + self.radiance(&on, share * part, Some(object), turns + 1, bundle) * part;
            }
        }
        light
    }

    /// The nearest object along a ray.
    fn nearest(&mut self, ray: &Ray<R>, left: Option<usize>, bundle: Bundle) -> Option<(usize, Sight<R>)> {
        let mut best: Option<(usize, Sight<R>)> = None;
        let in_view = (bundle == Bundle::FromEye).then(|| self.eye.towards(ray.dir));
        if in_view.is_some_and(<[u16]>::is_empty) {
            return None;
        }
        let slabs = Slabs::new(ray);
        for n in 0..in_view.map_or(self.seers.len(), <[u16]>::len) {
            let index = in_view.map_or(n, |objects| objects[n].into());
            if Some(index) == left {
                continue;
            }
            let to = best.as_ref().map_or(R::of(f64::INFINITY), |(_, sight)| sight.t);
            if let Some(sight) = self.sight(index, ray, &slabs, to, bundle) {
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
                if let Ok(answer) = self.askers[index].ask(ray, self.cache) {
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
        let world = self.world;
        let material = self.seers[object].material();
        let colour = Vec3::of(material.colour);
        let mut light = colour.scaled(Vec3::of(world.ambient)) * R::of(material.ambient);
        if material.is_dark() {
            return light;
        }
        let mut mirrored = None;
        for (light_index, lamp) in world.lights.iter().enumerate() {
            let way = Vec3::of(lamp.position) - sight.place;
            let far = way.length();
            let dir = way * (R::of(1.0) / far);
            let cosine = dir.dot(sight.normal);
            if cosine.get() <= 0.0 || self.seers[object].hides_itself(light_index, ray, sight, cosine) {
                continue;
            }
            let reaching = self.visibility(object, light_index, &Ray { origin: sight.place, dir }, far);
            if reaching.get() <= 0.0 {
                continue;
            }
            let lamp = Vec3::of(lamp.colour) * reaching;
            light = light + colour.scaled(lamp) * (cosine * R::of(material.diffuse));
            if material.specular > 0.0 {
                let mirrored = mirrored.get_or_insert_with(|| reflected(ray.dir, sight.normal));
                let towards = mirrored.dot(dir).max(R::of(0.0));
                if towards.get() > self.seers[object].highlight_from {
                    light = light + lamp * (towards.powf(material.shininess) * R::of(material.specular));
                }
            }
        }
        light
    }

    /// The share of a light that reaches a place of an object through all others.
    fn visibility(&mut self, object: usize, light: usize, ray: &Ray<R>, far: R) -> R {
        self.work.rays += 1;
        let mut share = R::of(1.0);
        let on_the_way = self.lights[light].towards(-ray.dir);
        if on_the_way.iter().all(|&index| usize::from(index) == object) {
            return share;
        }
        let slabs = Slabs::new(ray);
        for index in on_the_way.iter().map(|&index| usize::from(index)).filter(|&i| i != object) {
            let seer = &self.seers[index];
            let is_near = || slabs.entry(&seer.bounds, R::of(0.0), far).is_some();
            if share.get() > 0.0 && is_near() && seer.hides(light, ray, far) {
                share = share * R::of(seer.material().translucence());
            }
        }
        share
    }
}
