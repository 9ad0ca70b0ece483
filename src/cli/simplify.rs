//! `firstlight simplify IN -o OUT.obj`: reduces the number of triangles and measures the error.

use crate::cli::args::{OverwriteArgs, replaced};
use crate::cli::console::{inform, print, remark, tell};
use crate::cli::failure::Failure;
use crate::cli::number::{
    PrintedDeviation as MaxDeviation, parse_error, parse_faces, parse_ratio, percent, three_digits,
};
use crate::cli::stop::Stop;
use crate::cli::waiting::Waiting;
use clap::{Args, ValueEnum};
use firstlight::mesh::simplify::{Method, SimplifyError, Target, simplify};
use firstlight::mesh::{Deviation, Distances, Faults, Topology};
use firstlight::scene::absolute;
use firstlight::scene::model::{ImportedModel, ModelFormat, ModelNormals, ModelOptions, load_model};
use firstlight::scene::obj::{ObjExtras, save_obj};
use std::path::PathBuf;
use std::time::Instant;

pub const EXAMPLES: &str = "\
Examples:
  firstlight simplify bunny.obj -o small.obj --ratio 10%
  firstlight simplify scan.ply -o close.obj --error 0.1%";

#[derive(Args, Clone, Debug)]
#[command(group = clap::ArgGroup::new("target").required(true))]
pub struct SimplifyArgs {
    /// Model (.obj, .ply, .stl, .glb, .gltf, .vrm).
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Output file; an existing file is replaced.
    #[arg(short, long, value_name = "OUT.obj")]
    output: PathBuf,
    /// Keep this share of the triangles: 10% or 0.1.
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = parse_ratio, group = "target")]
    ratio: Option<f64>,
    /// Keep at most this many triangles.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = parse_faces, group = "target")]
    faces: Option<usize>,
    /// Maximum deviation from the original surface: 0.5% of the diagonal, or 0.01 in the units of the file.
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = parse_error, group = "target")]
    error: Option<MaxDeviation>,
    /// Cost function of the edge collapses.
    #[arg(long, value_enum, default_value = "quadric")]
    method: MethodArg,
    /// Allow the model to name a material library outside of its own folder.
    #[arg(long)]
    allow_outside: bool,
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum MethodArg {
    /// Quadric error metric: most accurate, multithreaded.
    Quadric,
    /// Edge length times curvature (Melax 1998): keeps vertex positions.
    Melax,
}

/// Points per direction of the error measurement.
const SAMPLES: usize = 200_000;

pub fn run(args: &SimplifyArgs, stop: &Stop) -> Result<(), Failure> {
    let method = match args.method {
        MethodArg::Quadric => Method::Quadric,
        MethodArg::Melax => Method::Melax,
    };
    let failed = |error: &dyn std::fmt::Display| Failure::Failed(error.to_string());
    // Outputs that cannot be written are reported before the work.
    if !args.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj")) {
        let message = format!(
            "{}: the output name must end in .obj: simplified models are written as Wavefront OBJ",
            args.output.display()
        );
        return Err(Failure::Usage(message));
    }
    let Some(format) = ModelFormat::of(&args.input) else {
        let (input, models) = (args.input.display(), ModelFormat::extensions());
        return Err(Failure::Usage(format!("{input}: unsupported file format: expected a model ({models})")));
    };
    let mut files = OverwriteArgs::default().files();
    files.read(&args.input)?;
    files.write(&args.output)?;
    let waiting = Waiting::new(format!("reading {}", args.input.display()));
    // Computed normals are not written: without normals in the file, the next program computes its own.
    let options = ModelOptions { allow_outside: args.allow_outside, ..ModelOptions::default() };
    let mut model = load_model(&args.input, format, &options).map_err(|error| failed(&error))?;
    if !model.normals_from_file {
        let options = ModelOptions { normals: ModelNormals::Ignore, ..options };
        model = load_model(&args.input, format, &options).map_err(|error| failed(&error))?;
    }
    files.read_all(model.libraries.iter().cloned())?;
    let mut warnings = model.warnings.clone();
    warnings.append(&model.material_warnings);
    warnings.extend(faults(&model).into_iter().map(|fault| format!("{}: {fault}", args.input.display())));
    tell(&warnings);
    let before = model.mesh.triangles.len();
    let diagonal = model.mesh.bounds().size().as_dvec3().length();
    let target = match (args.ratio, args.faces, args.error) {
        (Some(ratio), ..) => Target::Ratio(ratio),
        (_, Some(faces), _) => Target::Faces(faces),
        (.., error) => Target::Error(error.map_or(0.0, |error| error.length(diagonal))),
    };
    waiting.next(format!("simplifying {before} triangles"));
    let start = Instant::now();
    let result = simplify(&model.mesh, method, target).map_err(|error| match error {
        SimplifyError::Degenerate => Failure::Failed(format!("{}: {error}", args.input.display())),
        _ => Failure::Usage(error.to_string()),
    })?;
    let result = result.with_colors_of(&model.mesh);
    let seconds = start.elapsed().as_secs_f64();
    let after = result.triangles.len();
    let missed = match target {
        Target::Ratio(ratio) => after > ((before as f64 * ratio) as usize).max(1),
        Target::Faces(faces) => after > faces,
        Target::Error(_) => false,
    };
    if missed {
        remark(format_args!("warning: borders, seams and non-manifold edges allow no fewer than {after} triangles"));
    }
    // Materials that no library defines are not written.
    let kept = model.materials.iter().filter(|_| !model.libraries.is_empty());
    let has_textures = model.materials.iter().any(|material| material.diffuse_texture.is_some());
    if format == ModelFormat::Gltf || (format != ModelFormat::Obj && has_textures) {
        remark(format_args!("warning: materials and textures are not kept: only OBJ files name theirs in a library"));
    }
    let names: Vec<String> = kept.map(|material| material.name.clone()).collect();
    let comment = format!("{after} of {before} triangles, simplified by firstlight");
    let extras = ObjExtras { materials: &names, libraries: &model.libraries, comment: &comment };
    waiting.next(format!("writing {}", args.output.display()));
    let output = absolute(&args.output);
    let folder = output.parent().unwrap_or(&output);
    if let Some(library) = model.libraries.iter().find(|library| !absolute(library).starts_with(folder)) {
        let (output, library) = (args.output.display(), library.display());
        remark(format_args!("warning: {output} names {library}, which is not in its folder: --allow-outside reads it"));
    }
    save_obj(&args.output, &result, &extras).map_err(|error| failed(&error))?;
    stop.has_saved(format!("{} is saved; its deviation from the original was not measured", args.output.display()));
    waiting.next("measuring the deviation");
    let deviation = Deviation::between(&model.mesh, &result, SAMPLES);
    let topology = Topology::of(&result);
    drop(waiting);
    if args.json {
        let way = |d: Distances| serde_json::json!({ "mean": d.mean, "rms": d.rms, "max": d.max });
        let report = serde_json::json!({
            "input": args.input.to_string_lossy(),
            "output": args.output.to_string_lossy(),
            "method": format!("{method:?}").to_lowercase(),
            "faces_before": before,
            "faces_after": after,
            "vertices_after": result.positions.len(),
            "simplify_seconds": seconds,
            "diagonal": diagonal,
            "error_forward": way(deviation.forward),
            "error_backward": way(deviation.backward),
            "hausdorff": deviation.max(),
            "closed": topology.is_closed(),
            "manifold": topology.is_manifold(),
        });
        return print(report);
    }
    inform(format_args!("{}: model saved{}", args.output.display(), replaced(files.replaced())));
    print(format_args!("{before} -> {after} triangles in {seconds:.3} s"))?;
    for (name, d) in [("original to result", deviation.forward), ("result to original", deviation.backward)] {
        let percent = |length: f64| percent(length / diagonal);
        print(format_args!(
            "{name}: mean {}, RMS {}, maximum {} ({}, {}, {} of the diagonal)",
            three_digits(d.mean),
            three_digits(d.rms),
            three_digits(d.max),
            percent(d.mean),
            percent(d.rms),
            percent(d.max)
        ))?;
    }
    Ok(())
}

/// Defects of the input mesh and how they were treated, one sentence each.
fn faults(model: &ImportedModel) -> Vec<String> {
    let (triangles, edges) = (Faults::of(&model.mesh), Topology::of(&model.mesh));
    let counted = |count: usize, fate: &str| (count > 0).then(|| format!("{count} {fate}"));
    let left_out = Faults { flat: 0, ..triangles };
    let kept = Faults { flat: triangles.flat, ..Faults::default() };
    counted(model.polygons, "faces with more than three corners were triangulated")
        .into_iter()
        .chain(left_out.sentences().map(|fault| format!("{fault} and were removed")))
        .chain(kept.sentences())
        .chain(counted(edges.non_manifold_edges, "non-manifold edges (three or more triangles) are kept"))
        .chain(counted(edges.misoriented_edges, "edges between triangles of opposite orientation are kept"))
        .collect()
}
