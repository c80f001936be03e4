//! Refraction where rays enter the skin: the lens sits in a round pod of air that was moulded beside its place.

use crate::random::{Purpose, Stream};
use crate::scene::SceneConfig;

use super::light::{Vec2, dot};
use super::parts::PodRefraction;

/// The pod of one camera.
#[derive(Debug, Clone)]
pub(super) struct Pod {
    /// Its centre from the lens, mm.
    centre: Vec2,
    radius_mm: f64,
    index: f64,
}

impl Pod {
    pub(super) fn new(part: &PodRefraction, scene: &SceneConfig) -> Self {
        let mut random = Stream::new(scene.seed, Purpose::Pixels, 3);
        let (sin, cos) = libm::sincos(2.0 * core::f64::consts::PI * random.unit());
        Self {
            centre: [part.offset_mm * cos, part.offset_mm * sin],
            radius_mm: part.radius_mm,
            index: part.index,
        }
    }

    /// Where the ray from the lens at `lens` in the unit direction `d` enters the skin, and its direction there.
    pub(super) fn refract(&self, lens: Vec2, d: Vec2) -> (Vec2, Vec2) {
        let c = self.centre;
        let along = dot(c, d);
        // The lens is within the pod, so that the root is real and the larger solution is ahead.
        let s = along + (along * along - dot(c, c) + self.radius_mm * self.radius_mm).sqrt();
        let hit = [s * d[0], s * d[1]];
        let normal = [
            (hit[0] - c[0]) / self.radius_mm,
            (hit[1] - c[1]) / self.radius_mm,
        ];
        // Snell's law in vectors; into the denser medium nothing is totally reflected.
        let ratio = 1.0 / self.index;
        let cos_in = dot(normal, d);
        let cos_out = (1.0 - ratio * ratio * (1.0 - cos_in * cos_in)).sqrt();
        let turn = cos_out - ratio * cos_in;
        let direction = [
            ratio * d[0] + turn * normal[0],
            ratio * d[1] + turn * normal[1],
        ];
        ([lens[0] + hit[0], lens[1] + hit[1]], direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_obey_snell_and_a_centred_pod_bends_none() {
        let pod = |centre| Pod {
            centre,
            radius_mm: 3.0,
            index: 1.41,
        };
        for k in 0..24 {
            let (sin, cos) = libm::sincos(f64::from(k) * 0.261);
            let d = [cos, sin];
            let (from, to) = pod([0.0; 2]).refract([5.0, 7.0], d);
            assert!((to[0] - d[0]).abs() + (to[1] - d[1]).abs() < 1e-12);
            assert!((libm::hypot(from[0] - 5.0, from[1] - 7.0) - 3.0).abs() < 1e-12);

            let pod = pod([0.8, -0.5]);
            let (from, to) = pod.refract([0.0; 2], d);
            assert!((dot(to, to) - 1.0).abs() < 1e-12);
            let normal = [(from[0] - 0.8) / 3.0, (from[1] + 0.5) / 3.0];
            let sine = |v: Vec2| v[0] * normal[1] - v[1] * normal[0];
            assert!((sine(d) - 1.41 * sine(to)).abs() < 1e-12);
            assert!(dot(to, normal) > 0.0);
        }
    }
}
