//! Feature buffers of an image with world positions and the names of objects and materials: the form in which films
//! store them and layered images use them.

use crate::frame::image::snapshot_names::SnapshotNames;
use crate::render::{
    FeatureBuffers, FeatureIds, FeatureVariances, IdShares, Prepared, RenderSettings, gather_features_and_ids,
};
use crate::scene::{Extraction, SceneInputs};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Feature buffers of an image, with names.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureLayers {
    /// Feature buffers with ids; positions are in world space.
    pub buffers: FeatureBuffers,
    /// Names of the objects, by id. Objects that share a name share a mask.
    pub objects: Vec<String>,
    /// Names of the materials, by id.
    pub materials: Vec<String>,
}

/// Scene information for feature buffers that is not in the snapshot.
#[derive(Clone, Debug)]
pub struct FeatureNames {
    /// World position of the snapshot's origin, metres.
    origin: DVec3,
    objects: Vec<String>,
    materials: Vec<String>,
}

impl FeatureNames {
    /// - `inputs`: what the extraction was made from.
    pub fn of(extraction: &Extraction, inputs: &SceneInputs) -> Self {
        let names = SnapshotNames::of(extraction, inputs);
        let (objects, materials) = (names.objects().to_vec(), names.materials().to_vec());
        Self { origin: extraction.origin, objects, materials }
    }
}

impl FeatureLayers {
    /// Gathers the features of a scene from samples 0 up to `samples` of each pixel, on the current rayon pool; `None`
    /// if `stop` returned true.
    ///
    /// - `names`: of the same snapshot; `size`: of the film, pixels.
    pub fn gather(
        prepared: &Prepared,
        names: FeatureNames,
        settings: &RenderSettings,
        size: (u32, u32),
        samples: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let FeatureNames { origin, objects, materials } = names;
        let mut buffers = gather_features_and_ids(prepared, settings, size.into(), samples, stop)?;
        for (position, _) in buffers.position.iter_mut().zip(&buffers.coverage).filter(|(_, share)| **share > 0.0) {
            *position = (origin + position.as_dvec3()).as_vec3();
        }
        Some(Self { buffers, objects, materials })
    }

    /// Merges those of two parts of an image: the ones with more samples are kept; otherwise both are equal.
    pub fn of_parts(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.buffers.samples > a.buffers.samples { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// Returns the data that is not stored per pixel.
    pub(crate) fn header(&self) -> FeatureHeader {
        let Self { buffers, objects, materials } = self;
        FeatureHeader { samples: buffers.samples, objects: objects.clone(), materials: materials.clone() }
    }
}

/// Data of feature buffers in the header of a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FeatureHeader {
    samples: u32,
    objects: Vec<String>,
    materials: Vec<String>,
}

const RGB: [&str; 3] = ["R", "G", "B"];
const XYZ: [&str; 3] = ["X", "Y", "Z"];

/// Layers of feature buffers by name, as in an OpenEXR image: every list except ids.
pub(crate) const LAYERS: [&str; 9] = [
    "albedo",
    "normal",
    "position",
    "depth",
    "coverage",
    "albedo_variance",
    "normal_variance",
    "position_variance",
    "depth_variance",
];

/// The channels of one of [`LAYERS`], each with its name and one value per pixel.
pub(crate) fn channels_of(buffers: &FeatureBuffers, layer: &str) -> Vec<(String, Vec<f32>)> {
    let vectors = |channels: [&str; 3], list: &[Vec3]| {
        let channel = |(k, name): (usize, &str)| (format!("{layer}.{name}"), list.iter().map(|v| v[k]).collect());
        channels.into_iter().enumerate().map(channel).collect()
    };
    let numbers = |channel: &str, list: &[f32]| vec![(format!("{layer}.{channel}"), list.to_vec())];
    match layer {
        "albedo" => vectors(RGB, &buffers.albedo),
        "normal" => vectors(XYZ, &buffers.normal),
        "position" => vectors(XYZ, &buffers.position),
        "depth" => numbers("Z", &buffers.depth),
        "coverage" => numbers("Y", &buffers.coverage),
        "albedo_variance" => vectors(RGB, &buffers.variance.albedo),
        "normal_variance" => vectors(XYZ, &buffers.variance.normal),
        "position_variance" => vectors(XYZ, &buffers.variance.position),
        "depth_variance" => numbers("Z", &buffers.variance.depth),
        other => unreachable!("there is no layer {other}"),
    }
}

/// Ids and their sample counts, rank by rank, as stored in a film.
pub(crate) fn id_channels(buffers: &FeatureBuffers) -> Vec<(String, Vec<u32>)> {
    let Some(ids) = &buffers.ids else { return Vec::new() };
    let mut channels = Vec::new();
    for (kind, shares) in [("object", &ids.objects), ("material", &ids.materials)] {
        for rank in 0..IdShares::RANKS {
            channels.push((format!("{kind}.id{rank}"), shares.iter().map(|shares| shares.ranks[rank].0).collect()));
            channels
                .push((format!("{kind}.samples{rank}"), shares.iter().map(|shares| shares.ranks[rank].1).collect()));
        }
    }
    channels
}

/// Restores feature buffers from channels; the inverse of [`channels_of`] and [`id_channels`].
///
/// - `numbers`, `words`: return the channel of a name, one value per pixel.
///
/// # Errors
/// If a channel is missing or has values out of the range of its feature.
pub(crate) fn read_layers<E: From<String>>(
    header: FeatureHeader,
    (width, height): (u32, u32),
    numbers: impl Fn(&str) -> Result<Vec<f32>, E>,
    words: impl Fn(&str) -> Result<Vec<u32>, E>,
) -> Result<FeatureLayers, E> {
    let FeatureHeader { samples, objects, materials } = header;
    let vectors = |layer: &str, channels: [&str; 3]| -> Result<Vec<Vec3>, E> {
        let [x, y, z] = channels.map(|channel| numbers(&format!("{layer}.{channel}")));
        let (x, y, z) = (x?, y?, z?);
        Ok(x.into_iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(x, y, z)).collect())
    };
    let shares = |kind: &str, names: &[String]| -> Result<Vec<IdShares>, E> {
        let mut all = vec![IdShares::NONE; width as usize * height as usize];
        for rank in 0..IdShares::RANKS {
            let (ids, counts) = (words(&format!("{kind}.id{rank}"))?, words(&format!("{kind}.samples{rank}"))?);
            for (shares, pair) in all.iter_mut().zip(ids.into_iter().zip(counts)) {
                if pair.1 > samples || (pair.1 > 0 && pair.0 as usize >= names.len()) {
                    return Err(E::from(format!("its {kind} ids are inconsistent")));
                }
                shares.ranks[rank] = pair;
            }
        }
        Ok(all)
    };
    let buffers = FeatureBuffers {
        width,
        height,
        samples,
        albedo: vectors("albedo", RGB)?,
        normal: vectors("normal", XYZ)?,
        position: vectors("position", XYZ)?,
        depth: numbers("depth.Z")?,
        coverage: numbers("coverage.Y")?,
        variance: FeatureVariances {
            albedo: vectors("albedo_variance", RGB)?,
            normal: vectors("normal_variance", XYZ)?,
            position: vectors("position_variance", XYZ)?,
            depth: numbers("depth_variance.Z")?,
        },
        ids: Some(FeatureIds { objects: shares("object", &objects)?, materials: shares("material", &materials)? }),
    };
    Ok(FeatureLayers { buffers, objects, materials })
}
