//! Shading of sixteen paths at a time, held against one path at a time, sample by sample.

use crate::common::*;
use firstlight::kdtree::{BuildPreset, HitSpace, InstructionSet, MeshTree, Shape, SphereTree};
use firstlight::mesh::{Mesh, procedural};
use firstlight::render::{
    BadSample, CausticPlan, Channel, ColorInput, Cone, DeltaLight, Encoding, Environment, Falloff, Film, Fresnel,
    Geometry, ImageTexture, Integrator, LightImage, Material, Object, PixelFilter, Prepared, RenderSettings,
    ScalarInput, Shading, Snapshot, Techniques, Texture, TexturePattern, Wrap, advance, gather_features, replay_sample,
};
use glam::{Affine3A, Mat2, UVec2, Vec2, Vec3};
use std::sync::Arc;

fn metal(alpha: f32, fresnel: Fresnel, compensate: bool) -> Material {
    let reflectance = ColorInput::Constant(Vec3::new(0.9, 0.6, 0.3));
    Material::Metal { alpha: ScalarInput::Constant(alpha), reflectance, fresnel, compensate }
}

/// A mesh in its place, with its normals and surface coordinates.
fn placed(mesh: Mesh, world_from_object: Affine3A) -> (Shape, Option<Arc<Mesh>>) {
    let tree = Arc::new(MeshTree::build(&mesh.positions, &mesh.triangles, BuildPreset::Best));
    (Shape::Mesh { tree, world_from_object, space: HitSpace::Object }, Some(Arc::new(mesh)))
}

/// The same, tested in the space of the snapshot.
fn standing((mut shape, mesh): (Shape, Option<Arc<Mesh>>)) -> (Shape, Option<Arc<Mesh>>) {
    if let Shape::Mesh { space, .. } = &mut shape {
        *space = HitSpace::World;
    }
    (shape, mesh)
}

/// Moved by `to` after it was scaled.
fn scaled(scale: Vec3, to: Vec3) -> Affine3A {
    Affine3A::from_translation(to) * Affine3A::from_scale(scale)
}

/// A small cloud of spheres.
fn cloud(to: Vec3) -> Shape {
    let centers: Vec<Vec3> = (0..30).map(|i| Vec3::new((i % 6) as f32, (i / 6 % 2) as f32, (i / 12) as f32)).collect();
    let radii: Vec<f32> = (0..30).map(|i| 0.2 + 0.01 * i as f32).collect();
    let map = Affine3A::from_translation(to) * Affine3A::from_rotation_y(0.4) * Affine3A::from_scale(Vec3::splat(0.15));
    Shape::Spheres { tree: Arc::new(SphereTree::build(&centers, &radii)), world_from_object: map }
}

/// A room with a thing of each material, of each shape, under `lights`.
fn room(lights: Vec<(Shape, Option<Arc<Mesh>>)>, environment: Environment, air: Vec3) -> Prepared {
    room_with(lights, false, environment, air)
}

/// - `as_points`: the spheres among the lights stand for point lights.
fn room_with(
    lights: Vec<(Shape, Option<Arc<Mesh>>)>,
    as_points: bool,
    environment: Environment,
    air: Vec3,
) -> Prepared {
    let plain = |shape: Shape, material: u32| ((shape, None), material);
    let smooth = procedural::icosphere(3).with_vertex_normals();
    let mut unwrapped = procedural::icosphere(2).flat();
    unwrapped.uvs = unwrapped.positions.iter().map(|p| Vec2::new(0.3 * p.x + 0.1 * p.z, 0.2 * p.y)).collect();
    let mut colored = smooth.clone();
    colored.uvs = colored.positions.iter().map(|p| Vec2::new(p.x + 0.2 * p.z, p.y)).collect();
    colored.uvs2 = colored.uvs.iter().map(|uv| 1.5 * *uv + Vec2::splat(0.2)).collect();
    colored.colors = colored.positions.iter().map(|p| (0.5 * *p + 0.5).extend(0.8)).collect();
    colored.tangents = colored.positions.iter().map(|p| Vec3::Y.cross(*p).normalize_or_zero().extend(-1.0)).collect();
    let triangle = [Vec3::new(-2.0, 0.1, -1.0), Vec3::new(0.0, 0.3, -1.4), Vec3::new(-1.0, 2.0, -1.2)];
    let mut things = vec![
        plain(quad(Vec3::new(-3.0, 0.0, 3.0), Vec3::X * 6.0, Vec3::Z * -6.0), 0),
        plain(plane(Vec3::Z * -2.0, Vec3::new(0.1, 0.0, 1.0).normalize()), 10),
        plain(sphere(Vec3::new(-1.2, 0.5, 0.2), 0.5), 2),
        plain(sphere(Vec3::new(0.0, 0.5, 0.6), 0.5), 3),
        plain(Shape::Triangle { vertices: triangle }, 4),
        plain(sphere(Vec3::new(0.9, 0.3, 1.2), 0.3), 5),
        (placed(smooth.clone(), scaled(Vec3::splat(0.4), Vec3::new(1.2, 0.9, 0.4))), 6),
        plain(sphere(Vec3::new(-0.6, 0.25, 1.3), 0.25), 7),
        plain(sphere(Vec3::new(0.0, 0.4, 0.6), 0.2), 8),
        plain(sphere(Vec3::new(1.7, 0.35, 1.4), 0.35), 11),
        (placed(smooth.clone(), scaled(Vec3::new(-0.4, 0.3, 0.5), Vec3::new(-1.9, 0.8, -0.8))), 11),
        (placed(unwrapped.clone(), scaled(Vec3::new(0.3, 0.4, 0.3), Vec3::new(0.5, 1.4, -0.6))), 12),
        (standing(placed(smooth.clone(), scaled(Vec3::splat(0.3), Vec3::new(-0.5, 1.6, 0.0)))), 13),
        (standing(placed(smooth.clone(), scaled(Vec3::new(-0.2, 0.3, 0.2), Vec3::new(-1.3, 1.5, 0.3)))), 4),
        plain(cloud(Vec3::new(-1.6, 0.1, 1.6)), 13),
        plain(cloud(Vec3::new(0.6, 0.1, 2.0)), 1),
        plain(sphere(Vec3::new(-1.9, 0.3, 1.2), 0.3), 14),
        (placed(unwrapped.clone(), scaled(Vec3::new(0.3, -0.4, 0.3), Vec3::new(1.9, 1.3, 0.2))), 15),
        (standing(placed(smooth.clone(), scaled(Vec3::splat(0.35), Vec3::new(-0.3, 0.4, 2.0)))), 16),
        (standing(placed(colored.clone(), scaled(Vec3::new(0.3, 0.3, -0.3), Vec3::new(0.4, 0.9, 1.6)))), 17),
        plain(quad(Vec3::new(-2.4, 0.0, 0.0), Vec3::new(0.5, 0.0, 0.6), Vec3::Y), 15),
    ];
    // Seen from behind.
    let mut inside_out = unwrapped.clone();
    inside_out.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    for (x, material) in [(-2.2, 6), (-1.4, 18), (2.4, 24)] {
        things.push(plain(quad(Vec3::new(x, 0.6, -1.6), Vec3::Y, 0.7 * Vec3::X), material));
        things.push((placed(inside_out.clone(), scaled(Vec3::splat(0.2), Vec3::new(x, 2.6, 0.6))), material));
    }
    for (i, material) in (18..18 + shiny().len() as u32).enumerate() {
        let (x, mesh) = (0.6 * i as f32 - 2.1, if i % 2 == 0 { &unwrapped } else { &colored });
        things.push((placed(mesh.clone(), scaled(Vec3::splat(0.28), Vec3::new(x, 2.0, 0.6))), material));
        things.push(plain(sphere(Vec3::new(x, 0.2, 2.4), 0.2), material));
    }
    things.extend(lights.into_iter().map(|light| (light, 9)));
    let checker = ColorInput::Texture(0);
    let mut materials = vec![
        Material::Diffuse { albedo: checker },
        diffuse(0.6),
        Material::Mirror { reflectance: ColorInput::Constant(Vec3::new(0.9, 0.95, 0.8)) },
        Material::Glass { ior: 1.5, absorption: Vec3::new(0.3, 0.1, 0.5), dispersion: 0.0 },
        metal(0.15, Fresnel::Constant, false),
        metal(0.4, Fresnel::Schlick, true),
        Material::Diffuse { albedo: ColorInput::Constant(Vec3::new(0.7, 0.2, 0.1)) },
        metal(1e-6, Fresnel::Schlick, false),
        Material::Glass { ior: 1.2, absorption: Vec3::ZERO, dispersion: 0.0 },
        emissive(7.0),
        Material::Diffuse { albedo: ColorInput::Texture(1) },
        // Diffuse under metal, metal that is diffuse in places, and the classic kind.
        Material::blend(ScalarInput::Constant(0.3), 6, 5),
        Material::blend(ScalarInput::Constant(0.6), 4, 10),
        Material::Phong {
            diffuse: checker,
            ambient: 0.0,
            specular: ScalarInput::Constant(0.25),
            shininess: 30.0,
            transparency: 0.0,
            ior: 1.5,
            absorption: Vec3::ZERO,
        },
    ];
    materials.extend(layered());
    materials.extend(shiny());
    let objects = things.iter().map(|((shape, mesh), material)| {
        let is_point_light = as_points && *material == 9 && matches!(shape, Shape::Sphere { .. });
        Object { mesh: mesh.clone(), is_point_light, ..Object::plain(*material) }
    });
    let objects = objects.collect();
    let geometry = Geometry::build(things.into_iter().map(|((shape, _), _)| shape).collect(), objects);
    let texture = |pattern, scale| Texture {
        uv_matrix: Mat2::from_diagonal(Vec2::splat(scale)),
        uv_offset: Vec2::new(0.1, 0.0),
        ..Texture::new(pattern)
    };
    let texels = (0..12).map(|i| Vec3::new(0.1 + 0.06 * i as f32, 0.5, 0.9 - 0.07 * i as f32)).collect();
    let image = Arc::new(ImageTexture::from_linear(4, 3, texels));
    let normals = (0..4).map(|i| Vec3::new(0.4 + 0.1 * (i % 2) as f32, 0.55 - 0.08 * (i / 2) as f32, 1.0)).collect();
    let normals = Arc::new(ImageTexture::from_linear(2, 2, normals));
    let smooth = |image: &Arc<ImageTexture>| TexturePattern::Image {
        image: image.clone(),
        encoding: Encoding::Auto,
        wrap: [Wrap::Mirror, Wrap::Repeat],
        smooth: true,
    };
    let colors = texture(smooth(&image), 0.9);
    let textures = vec![
        texture(TexturePattern::Checker { a: Vec3::splat(0.7), b: Vec3::new(0.1, 0.3, 0.5) }, 9.0),
        texture(TexturePattern::Image { image, encoding: Encoding::Auto, wrap: [Wrap::Repeat; 2], smooth: false }, 0.7),
        texture(smooth(&normals), 2.0),
        Texture { channel: Some(Channel::R), ..colors.clone() },
        Texture { channel: Some(Channel::B), invert: true, ..colors.clone() },
        Texture { uv_set: 1, vertex_colors: true, ..colors.clone() },
        Texture { channel: Some(Channel::R), relief: Some(0.3), ..colors },
    ];
    let shading = Shading { air, ..Shading::new(materials, textures, environment) };
    let mut camera = camera(Vec3::new(0.2, 1.6, 5.0), Vec3::new(0.0, 0.6, 0.0), 42.0);
    (camera.lens_radius, camera.focus_distance) = (0.03, 5.0);
    Prepared::new(Snapshot::new(geometry, shading, camera))
}

/// Layered materials by their layers; they use textures 1 to 5 of the room.
fn layered() -> [Material; 4] {
    let base = |color: ColorInput| Material::principled(color);
    let mut plastic = base(ColorInput::Constant(Vec3::new(0.6, 0.3, 0.2)));
    let mut mapped = base(ColorInput::Texture(1));
    let mut rich = base(ColorInput::Texture(1));
    let mut colored = base(ColorInput::Texture(5));
    if let Material::Principled { metallic, roughness, specular_color, .. } = &mut plastic {
        (*metallic, *roughness) = (ScalarInput::Constant(0.3), ScalarInput::Constant(0.0));
        *specular_color = ColorInput::Constant(Vec3::new(1.0, 0.8, 0.6));
    }
    if let Material::Principled { metallic, roughness, normal_map, normal_scale, .. } = &mut mapped {
        (*metallic, *roughness) = (ScalarInput::Texture(3), ScalarInput::Texture(4));
        (*normal_map, *normal_scale) = (ColorInput::Texture(2), 0.8);
    }
    if let Material::Principled { clearcoat, clearcoat_roughness, sheen_color, anisotropy, roughness, .. } = &mut rich {
        (*clearcoat, *clearcoat_roughness) = (ScalarInput::Texture(3), ScalarInput::Constant(0.3));
        *sheen_color = ColorInput::Constant(Vec3::new(0.2, 0.3, 0.1));
        (*anisotropy, *roughness) = (ScalarInput::Texture(4), ScalarInput::Constant(0.4));
    }
    if let Material::Principled { metallic, roughness, normal_map, clearcoat, anisotropy, .. } = &mut colored {
        (*metallic, *roughness) = (ScalarInput::Constant(1.0), ScalarInput::Texture(3));
        (*normal_map, *clearcoat) = (ColorInput::Texture(2), ScalarInput::Constant(0.5));
        *anisotropy = ScalarInput::Constant(0.6);
    }
    [plastic, mapped, rich, colored]
}

/// Plastics, with normals by a map and with holes, a relief, conductors, a leaf, and surfaces of Disney; they use textures 1
/// to 6 of the room.
fn shiny() -> [Material; 16] {
    let plastic = |diffuse, alpha, beckmann, nonlinear| Material::Plastic {
        diffuse,
        alpha,
        ior: if nonlinear { 1.5 } else { 1.9 },
        specular: ScalarInput::Constant(0.8),
        nonlinear,
        beckmann,
    };
    let gold = |[alpha, alpha_v]: [ScalarInput; 2], beckmann, reflectance, compensate| Material::Conductor {
        alpha,
        alpha_v,
        beckmann,
        eta: Vec3::new(0.143, 0.375, 1.442),
        k: Vec3::new(3.983, 2.386, 1.603),
        reflectance,
        compensate,
    };
    let [none, narrow, wide] = [0.0, 0.1, 0.3].map(ScalarInput::Constant);
    let white = ColorInput::Constant(Vec3::ONE);
    let disney = |base_color, anisotropic, transmission| Material::Disney {
        base_color,
        metallic: ScalarInput::Texture(4),
        roughness: ScalarInput::Constant(0.4),
        anisotropic,
        ior: 1.6,
        specular_tint: ScalarInput::Constant(0.3),
        transmission,
        thin_walled: false,
        diffuse_transmission: none,
        flatness: wide,
        sheen: ScalarInput::Texture(3),
        sheen_tint: wide,
        clearcoat: ScalarInput::Constant(0.8),
        clearcoat_gloss: ScalarInput::Texture(4),
    };
    let mut sheet = disney(ColorInput::Texture(1), none, none);
    if let Material::Disney { thin_walled, .. } = &mut sheet {
        *thin_walled = true;
    }
    let mut with_holes = Material::blend(ScalarInput::Constant(0.0), 19, 19);
    if let Material::Blend { opacity, .. } = &mut with_holes {
        *opacity = ScalarInput::Texture(4);
    }
    let turned = |part, map| {
        let mut blend = Material::blend(ScalarInput::Constant(0.0), part, part);
        if let Material::Blend { normal_map, normal_scale, .. } = &mut blend {
            (*normal_map, *normal_scale) = (ColorInput::Texture(map), 0.7);
        }
        blend
    };
    [
        plastic(ColorInput::Texture(1), none, false, true),
        plastic(ColorInput::Texture(5), ScalarInput::Texture(3), false, false),
        turned(18, 2),
        turned(6, 6),
        plastic(ColorInput::Constant(Vec3::new(0.7, 0.3, 0.1)), wide, true, true),
        plastic(ColorInput::Constant(Vec3::new(0.1, 0.3, 0.7)), narrow, false, true),
        gold([wide, none], false, white, false),
        gold([wide, narrow], false, ColorInput::Texture(5), true),
        gold([none, none], false, ColorInput::Texture(1), false),
        gold([ScalarInput::Texture(3), narrow], true, white, false),
        Material::Translucent { reflectance: ColorInput::Texture(1), transmittance: ColorInput::Texture(5) },
        disney(ColorInput::Texture(1), none, none),
        disney(ColorInput::Constant(Vec3::new(0.1, 0.6, 0.3)), ScalarInput::Texture(3), none),
        disney(ColorInput::Texture(5), narrow, wide),
        with_holes,
        sheet,
    ]
}

/// The same with layers that emit as well: in places, and where half of the surface is.
fn with_emission(scene: &Prepared) -> Prepared {
    let mut shading = (*scene.shading).clone();
    let lights = [(ColorInput::Texture(0), 1.0), (ColorInput::Constant(Vec3::new(2.0, 1.0, 1.5)), 0.5)];
    for (material, (light, share)) in shading.materials[15..17].iter_mut().zip(lights) {
        if let Material::Principled { emission, opacity, .. } = material {
            (*emission, *opacity) = (light, ScalarInput::Constant(share));
        }
    }
    scene.with_shading(Arc::new(shading))
}

/// The same with the backs of its plain materials black.
fn one_sided(scene: &Prepared) -> Prepared {
    let mut shading = (*scene.shading).clone();
    let n = shading.materials.len();
    let black = n as u32;
    shading.materials.push(emissive(0.0));
    for i in 0..n {
        use Material::{Conductor, Diffuse, Disney, Metal, Mirror, Plastic, Translucent};
        let is_plain = matches!(
            shading.materials[i],
            Diffuse { .. }
                | Mirror { .. }
                | Metal { .. }
                | Plastic { .. }
                | Conductor { .. }
                | Translucent { .. }
                | Disney { .. }
        );
        if is_plain {
            let mut sided = Material::blend(ScalarInput::Constant(0.0), shading.materials.len() as u32, black);
            if let Material::Blend { by_side, .. } = &mut sided {
                *by_side = true;
            }
            let plain = std::mem::replace(&mut shading.materials[i], sided);
            shading.materials.push(plain);
        }
    }
    scene.with_shading(Arc::new(shading))
}

fn rooms() -> Vec<(&'static str, Prepared)> {
    let ball = || (sphere(Vec3::new(1.5, 2.5, 1.0), 0.4), None);
    let lamp = || (quad(Vec3::new(-1.0, 3.0, -0.5), Vec3::X * 1.2, Vec3::Z * 0.9), None);
    let slanted = || (quad(Vec3::new(-2.5, 1.0, 1.0), Vec3::new(0.1, 0.6, 0.1), Vec3::new(0.2, 0.1, 0.8)), None);
    let many = || (0..20).map(|i| (sphere(Vec3::new(i as f32 * 0.2 - 2.0, 2.6, 0.5), 0.08), None)).collect::<Vec<_>>();
    let texels = (0..32).map(|i| Vec3::new(0.1 + 0.02 * i as f32, 0.4, if i == 9 { 8.0 } else { 0.3 })).collect();
    let image = Arc::new(ImageTexture::from_linear(8, 4, texels));
    let picture = Environment::Image { image, scale: Vec3::ONE, rotation: 0.4 };
    let triangle =
        Shape::Triangle { vertices: [Vec3::new(-1.0, 3.0, 0.0), Vec3::new(1.0, 3.0, 0.0), Vec3::new(0.0, 3.0, 1.0)] };
    // Faces of a tenth of a steradian, and of a thousandth.
    let shining = || placed(procedural::icosphere(1), scaled(Vec3::new(0.5, -0.4, 0.5), Vec3::new(-0.5, 2.6, 0.5)));
    let small = || placed(procedural::icosphere(3), scaled(Vec3::splat(0.15), Vec3::new(1.2, 2.4, 1.0)));
    let sky = Environment::Gradient { zenith: Vec3::new(0.2, 0.4, 0.9), horizon: Vec3::ONE, ground: Vec3::splat(0.1) };
    let cone = Cone::new(Vec3::new(0.3, -1.0, 0.1).normalize(), 0.3, 0.7, Falloff::Smooth);
    let right = cone.axis.any_orthonormal_vector();
    let axes = [right, right.cross(cone.axis), cone.axis];
    let image = LightImage { texture: None, axes, half: Vec2::new(0.4, 0.6), even: true };
    let without_size = |n: usize| -> Vec<DeltaLight> {
        (0..n)
            .map(|i| {
                let position = Vec3::new(2.0 - 4.0 * i as f32 / n as f32, 2.6, 0.5 + (i as f32).sin());
                let intensity = Vec3::new(1.0, 0.8, 0.6) * (1.0 + (i % 4) as f32);
                match i % 3 {
                    0 => DeltaLight::Point { position, intensity },
                    1 => DeltaLight::Spot { position, intensity, cone, image: (i % 2 == 0).then_some(image) },
                    _ => DeltaLight::Directional { direction: -position.normalize(), irradiance: 0.1 * intensity },
                }
            })
            .collect()
    };
    let with = |scene: Prepared, n| with_lights(&scene, without_size(n));
    let fog = Vec3::splat(0.03);
    vec![
        ("without size", with(room(vec![], Environment::Black, fog), 3)),
        ("without size, a ball and a quad", with(room(vec![ball(), lamp()], sky.clone(), fog), 5)),
        ("many without size", with(room(vec![lamp(), ball()], Environment::Black, Vec3::ZERO), 40)),
        ("one quad", room(vec![lamp()], Environment::Black, Vec3::ZERO)),
        ("one ball", room(vec![ball()], Environment::Constant(Vec3::splat(0.3)), Vec3::ZERO)),
        ("both and a slanted one", room(vec![ball(), lamp(), slanted()], sky.clone(), Vec3::splat(0.05))),
        ("a triangle", room(vec![(triangle, None), ball()], Environment::Black, Vec3::ZERO)),
        ("many", room(many(), Environment::Black, Vec3::ZERO)),
        ("points and a quad", room_with(vec![ball(), lamp()], true, sky.clone(), Vec3::ZERO)),
        ("many points", room_with(many(), true, Environment::Black, Vec3::splat(0.02))),
        ("a picture and a ball", room(vec![ball()], picture, Vec3::ZERO)),
        ("layers that shine", with_emission(&room(vec![ball()], sky.clone(), fog))),
        ("black backs", one_sided(&room(vec![ball(), slanted()], sky.clone(), Vec3::ZERO))),
        ("meshes that shine", room(vec![shining(), small(), ball(), lamp()], Environment::Black, Vec3::ZERO)),
    ]
}

#[test]
fn lanes_see_the_features_that_one_hit_at_a_time_has() {
    let albedo = |scene: &Prepared| {
        let size = UVec2::new(120, 90);
        gather_features(scene, &RenderSettings::default(), size, 2, &|| false).expect("nothing stops it").albedo
    };
    let usual = room(vec![], Environment::Black, Vec3::ZERO);
    let black = |albedo: &[Vec3]| albedo.iter().filter(|albedo| **albedo == Vec3::ZERO).count();
    let [n, n_usual] = [&one_sided(&usual), &usual].map(|scene| black(&albedo(scene)));
    assert!(n > n_usual + 50, "{n} pixels show black backs");
    for (name, scene) in rooms() {
        let features = |simd| {
            let settings = RenderSettings { simd, ..RenderSettings::default() };
            gather_features(&scene, &settings, UVec2::new(120, 90), 2, &|| false).expect("nothing stops it")
        };
        let one_at_a_time = features(None);
        for set in InstructionSet::available() {
            assert!(features(Some(set)) == one_at_a_time, "{name}, {set:?}");
        }
    }
}

#[test]
fn lanes_find_what_one_path_at_a_time_finds() {
    compare_with_one_at_a_time(Integrator::Path);
}

#[test]
fn classic_lanes_find_what_one_ray_at_a_time_finds() {
    compare_with_one_at_a_time(Integrator::Phong);
}

fn compare_with_one_at_a_time(integrator: Integrator) {
    for (name, scene) in rooms() {
        for techniques in std::iter::once(Techniques::ALL).chain(Techniques::ablations().map(|(_, t)| t)) {
            // Only where samples lie makes a difference to the classic model.
            if integrator == Integrator::Phong && techniques != Techniques::ALL && techniques.even_samples {
                continue;
            }
            let lanes = RenderSettings { integrator, techniques, seed: 7, max_depth: 12, ..RenderSettings::default() };
            let single = RenderSettings { simd: None, ..lanes };
            let size = UVec2::new(24, 24);
            let (mut n_differing, n) = (0, if techniques == Techniques::ALL { 24 * 24 * 4 } else { 24 * 24 });
            let (mut sums, mut differing_by) = ([0.0f64; 2], 0.0);
            for i in 0..n {
                let at = BadSample { x: i % 24, y: i / 24 % 24, sample: i / 576 };
                let [a, b] = [&lanes, &single].map(|settings| replay_sample(&scene, settings, size, at).y);
                // Rounding may send a path past an edge, or end it where it would have gone on.
                n_differing += u32::from((a - b).abs() > 1e-2 * b + 1e-5);
                // Rare bright samples say little about the rest.
                let [a, b] = [a, b].map(|y| f64::from(y.min(20.0)));
                sums[0] += a;
                sums[1] += b;
                differing_by += (a - b).powi(2);
            }
            let share = f64::from(n_differing) / f64::from(n);
            assert!(share < 0.02, "{name}, {techniques:?}: {share} of the samples differ");
            // The means differ by no more than the few samples that do.
            let difference = (sums[0] - sums[1]).abs();
            assert!(difference <= 4.0 * differing_by.sqrt() + 1e-3 * sums[1], "{name}, {techniques:?}: {sums:?}");
        }
    }
}

/// Light paths are in films alone: whole pictures, with the same numbers for both.
#[test]
fn lanes_light_what_one_path_at_a_time_lights() {
    let mut n_lit = 0;
    for (name, scene) in rooms() {
        for techniques in [Techniques::ALL, Techniques { mis: false, ..Techniques::ALL }] {
            let draw = |lanes, caustics| {
                let techniques = Techniques { caustics, caustic_plan: Some(CausticPlan::UNKNOWN), ..techniques };
                let settings =
                    RenderSettings { techniques, simd: lanes, seed: 3, max_depth: 10, ..RenderSettings::default() };
                let mut film = Film::new(48, 48);
                advance(&scene, &settings, &mut film, 1, &|| false);
                film.means().iter().map(|mean| f64::from(mean.y)).collect::<Vec<_>>()
            };
            let single = draw(None, true);
            let lanes = draw(RenderSettings::default().simd, true);
            let without = draw(None, false);
            let differ = |a: f64, b: f64| (a - b).abs() > 1e-2 * b + 1e-5;
            let count = |a: &[f64], b: &[f64]| a.iter().zip(b).filter(|(a, b)| differ(**a, **b)).count();
            n_lit += count(&single, &without);
            // Rounding may send a path past an edge, or end it where it would have gone on.
            let share = count(&lanes, &single) as f64 / single.len() as f64;
            assert!(share < 0.02, "{name}, MIS {}: {share} of the pixels differ", techniques.mis);
        }
    }
    assert!(n_lit > 4_000, "{n_lit} pixels say little");
}

#[test]
fn all_instruction_sets_draw_the_same_picture() {
    for (name, scene) in rooms() {
        for (integrator, filter) in [
            (Integrator::Path, PixelFilter::Box),
            (Integrator::Path, PixelFilter::Tent),
            (Integrator::Phong, PixelFilter::Box),
        ] {
            let draw = |set| {
                let settings = RenderSettings { integrator, simd: Some(set), filter, ..RenderSettings::default() };
                let mut film = Film::new(21, 19);
                advance(&scene, &settings, &mut film, 4, &|| false);
                film.means().iter().flat_map(|mean| mean.to_array().map(f32::to_bits)).collect::<Vec<_>>()
            };
            let expected = draw(InstructionSet::Portable);
            for set in InstructionSet::available() {
                assert!(draw(set) == expected, "{name}, {integrator:?}, {filter:?}: {set:?}");
            }
        }
    }
}
