//! Light sampling for sixteen points at a time, see [`LightTable`].

use crate::core::techniques::Techniques;
use crate::core::texture::Texture;
use crate::prepare::light::LightTable;
use crate::prepare::light::arrays::{DELTA, LightArrays, LightLanes, POINT, VARIED};
use crate::prepare::light::selection::MAX_ESTIMATED;
use crate::sampling::SamplerLanes;
use firstlight_simd::{Bits, Float, LANES, Mask, Real, Simd, Vector, select};
use glam::{Vec2, Vec3};

impl LightTable {
    /// Like [`Self::sample`], for the lanes of `mask`; `None` if there are no lights.
    ///
    /// - `normal`: of one side; light from both sides matters if there is none;
    /// - `u_select`: used only if [`Self::selects_apart`].
    #[inline(always)]
    pub(crate) fn sample_lanes<S: Simd>(
        &self,
        textures: &[Texture],
        techniques: &Techniques,
        mask: Mask,
        (position, normal): (Vector<S>, Option<Vector<S>>),
        u_select: Float<S>,
        mut u: [Float<S>; 2],
    ) -> Option<LightLanes<S>> {
        let wide = self.lanes.as_ref()?;
        let (id, pmf, mask) = self.select_lanes(wide, techniques, mask, (position, normal), u_select, &mut u[0]);
        let found = wide.points(techniques.solid_angle, id, mask, position, u);
        let mut sample = self.shining(wide, textures, id, mask, position, found);
        sample.pdf = sample.pdf * pmf;
        Some(sample)
    }

    /// Sets the radiance of points on lights, and replaces the lanes of delta lights.
    #[inline(always)]
    fn shining<S: Simd>(
        &self,
        wide: &LightArrays,
        textures: &[Texture],
        id: Bits<S>,
        mask: Mask,
        position: Vector<S>,
        mut points: LightLanes<S>,
    ) -> LightLanes<S> {
        points.radiance = Vector::gather(&wide.radiance, id);
        if wide.has_deltas {
            points = wide.with_deltas(id, mask, position, points);
        }
        if wide.has_varied {
            let varied = points.found & Bits::gather(&wide.flags, id).has(VARIED);
            if varied != 0 {
                self.vary(textures, id.to_array(), varied, &mut points);
            }
        }
        points
    }

    /// Multiplies by the radiance of lights that varies, one at a time.
    #[inline(never)]
    fn vary<S: Simd>(&self, textures: &[Texture], ids: [u32; LANES], mask: Mask, points: &mut LightLanes<S>) {
        let [targets, directions] = [points.target, points.wi].map(|vector| vector.to_arrays());
        let uvs = points.uv.map(|uv| uv.to_array());
        let mut radiance = points.radiance.to_arrays();
        for lane in (0..LANES).filter(|lane| mask >> lane & 1 != 0) {
            let light = &self.lights[ids[lane] as usize];
            let at = |vectors: &[[f32; LANES]; 3]| Vec3::new(vectors[0][lane], vectors[1][lane], vectors[2][lane]);
            let normal = match light.image {
                Some(_) => -at(&directions),
                None => light.shape.normal_at(at(&targets)),
            };
            let found = light.radiance(textures, normal, Vec2::new(uvs[0][lane], uvs[1][lane]));
            radiance.iter_mut().zip(found.to_array()).for_each(|(channel, factor)| channel[lane] *= factor);
        }
        points.radiance = Vector::from_arrays(points.pdf.s, &radiance);
    }

    /// Number of samples of [`Self::sample_each`].
    pub(crate) fn n_each(&self) -> usize {
        if self.selects_apart() { 1 } else { self.lights.len() }
    }

    /// Returns sample `k` of [`Self::sample_each`] for the lanes of `mask`, and the lanes whose light is a point.
    /// Requires [`Self::has_lanes`].
    #[inline(always)]
    pub(crate) fn sample_each_lanes<S: Simd>(
        &self,
        textures: &[Texture],
        k: u32,
        mut mask: Mask,
        position: Vector<S>,
        sampler: &SamplerLanes<S>,
        mut dimension: u32,
    ) -> (LightLanes<S>, Mask) {
        let wide = self.lanes.as_ref().expect("lanes are asked only where there are any");
        let s = position.x.s;
        let (mut id, mut pmf) = (Bits::splat(s, k), Float::splat(s, 1.0));
        dimension += k;
        if self.selects_apart() {
            let choices = sampler.single(dimension).to_array();
            let (mut ids, mut pmfs) = ([0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                if let Some(chosen) = self.selection.by_power(choices[lane]) {
                    (ids[lane], pmfs[lane]) = chosen;
                }
            }
            (id, pmf) = (Bits::load(s, &ids), Float::load(s, &pmfs));
            mask &= pmf.is_positive();
            dimension += 1;
        }
        let flags = Bits::gather(&wide.flags, id);
        let as_point = mask & flags.has(POINT | DELTA);
        let by_area = mask & !as_point;
        let nowhere = Vector::splat(s, Vec3::ZERO);
        let uv = [Float::splat(s, 0.0); 2];
        let mut found =
            LightLanes { found: 0, target: nowhere, wi: nowhere, pdf: pmf, radiance: nowhere, is_far: 0, uv };
        if by_area != 0 {
            found = wide.points(true, id, by_area, position, sampler.pair(dimension));
        }
        let spheres = as_point & flags.has(POINT);
        if spheres != 0 {
            found = wide.as_points(id, spheres, position).over(spheres, found);
        }
        found = self.shining(wide, textures, id, mask, position, found);
        found.pdf = found.pdf * pmf;
        (found, as_point)
    }

    /// Whether there are so many lights that choosing one takes a separate random number.
    pub(crate) fn selects_apart(&self) -> bool {
        self.lights.len() > MAX_ESTIMATED
    }

    /// Whether sixteen points at a time are supported.
    pub(crate) fn has_lanes(&self) -> bool {
        self.lanes.is_some()
    }

    /// See [`Self::pdf`]; requires [`Self::has_lanes`].
    #[inline(always)]
    pub(crate) fn pdf_lanes<S: Simd>(
        &self,
        techniques: &Techniques,
        mask: Mask,
        id: Bits<S>,
        [position, normal]: [Vector<S>; 2],
        wi: Vector<S>,
        distance: Float<S>,
    ) -> Float<S> {
        let wide = self.lanes.as_ref().expect("lanes are asked only where there are any");
        let one = distance.all(1.0);
        let pdf = wide.pdf(techniques.solid_angle, id, position, wi, distance);
        if wide.n == 1 {
            return pdf;
        }
        if !techniques.light_selection {
            return pdf * (1.0 / wide.n as f32);
        }
        if wide.n > MAX_ESTIMATED {
            return pdf * self.selection.wide_tree().pmf(mask, id, position, normal);
        }
        let (mut own, mut sum) = (one.all(0.0), one.all(0.0));
        for (i, bounds) in (0..).zip(self.selection.bounds()) {
            let estimate = bounds.estimate_at(position, Some(normal));
            own = select(id.equals(i), estimate, own);
            sum += estimate;
        }
        select(sum.is_positive(), pdf * own / sum, one.all(0.0))
    }

    /// Selects a light per lane; returns it, its probability, and the lanes that some light can reach.
    #[inline(always)]
    fn select_lanes<S: Simd>(
        &self,
        wide: &LightArrays,
        techniques: &Techniques,
        mask: Mask,
        (position, normal): (Vector<S>, Option<Vector<S>>),
        u_select: Float<S>,
        u: &mut Float<S>,
    ) -> (Bits<S>, Float<S>, Mask) {
        let s = position.x.s;
        if wide.n == 1 {
            return (Bits::splat(s, 0), Float::splat(s, 1.0), mask);
        }
        if !techniques.light_selection {
            let scaled = *u * wide.n as f32;
            let id = scaled.truncate();
            *u = scaled - id.to_float();
            return (id, Float::splat(s, 1.0 / wide.n as f32), mask);
        }
        if wide.n > MAX_ESTIMATED {
            return self.selection.wide_tree().sample(mask, position, normal, u_select);
        }
        let mut estimates = [Float::splat(s, 0.0); LANES];
        let mut sum = Float::splat(s, 0.0);
        for (estimate, bounds) in estimates.iter_mut().zip(self.selection.bounds()) {
            *estimate = bounds.estimate_at(position, normal);
            sum += *estimate;
        }
        let mut rest = *u * sum;
        let mut within = rest;
        let (mut id, mut chosen) = (Bits::splat(s, 0), Float::splat(s, 0.0));
        let mut open = mask;
        for (i, &estimate) in (0..).zip(&estimates[..wide.n]) {
            // Until a light takes the lane, it holds the last possible one: rounding may leave a remainder.
            let take = open & estimate.is_positive();
            id = Bits { s, v: s.select_u(take, s.splat_u(i), id.v) };
            chosen = select(take, estimate, chosen);
            within = select(take, rest, within);
            rest = rest - estimate;
            open &= !rest.lt(rest.all(0.0));
        }
        *u = (within / chosen).at_least(0.0).at_most(1.0f32.next_down());
        (id, chosen / sum, mask & chosen.is_positive())
    }
}
