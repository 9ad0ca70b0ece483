//! `firstlight info --tree SCENE|MODEL`: build and traversal costs of each split method for each mesh.

use crate::cli::console::{inform, lines, print};
use crate::cli::failure::Failure;
use firstlight::kdtree::{self, BuildPreset};
use firstlight::mesh::Mesh;
use firstlight::printable;
use firstlight::report::{MeanVisits, TreePlan, TreeRow, TreeTable, tree_plans};
use firstlight::scene::{Extraction, SceneInputs, Shape};
use glam::Affine3A;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::sync::Arc;

pub fn run(inputs: &SceneInputs, extraction: &Extraction, json: bool) -> Result<(), Failure> {
    let meshes = meshes(inputs, extraction);
    if meshes.is_empty() {
        return Err(Failure::Failed(
            "the scene has no mesh: --tree compares kd-trees over the triangles of meshes".to_owned(),
        ));
    }
    let plans = tree_plans();
    let mut tables = Vec::new();
    for (name, mesh, world_from_mesh) in &meshes {
        let mut done = 0;
        let table = TreeTable::measure(mesh, *world_from_mesh, &plans, |plan| {
            done += 1;
            let what = plan_name(plan);
            inform(format_args!("{}: tree {done} of {}, {} {}", printable::name(name), plans.len(), what.0, what.1));
        });
        if !json {
            print(lines(&text(&printable::name(name), &table)))?;
        }
        tables.push(as_json(name, &table));
    }
    if json {
        print(serde_json::json!({ "meshes": tables }))?;
    }
    Ok(())
}

/// Each mesh once, with the name and transform of its first object.
fn meshes(inputs: &SceneInputs, extraction: &Extraction) -> Vec<(String, Arc<Mesh>, Affine3A)> {
    let objects: HashMap<_, _> = inputs.objects.iter().map(|object| (object.entity, object)).collect();
    let mut known = HashSet::new();
    let mut found: Vec<(String, Arc<Mesh>, Affine3A)> = Vec::new();
    for (entity, shape) in extraction.entities.iter().zip(extraction.prepared.geometry.tree.shapes()) {
        let kdtree::Shape::Mesh { world_from_object, .. } = shape else { continue };
        let Some(object) = objects.get(entity) else { continue };
        let Shape::Mesh(mesh) = &object.shape else { continue };
        if known.insert(Arc::as_ptr(mesh)) {
            let name = object.name.clone().unwrap_or_else(|| format!("mesh {}", found.len() + 1));
            found.push((name, mesh.clone(), *world_from_object));
        }
    }
    found
}

fn plan_name(plan: TreePlan) -> (&'static str, String) {
    let split = match plan.preset {
        BuildPreset::Median => "median",
        BuildPreset::Quick => "SAH, quick",
        BuildPreset::Best => "SAH, best",
    };
    (split, plan.leaf_limit.map_or_else(|| "by cost".to_owned(), |limit| limit.to_string()))
}

fn text(name: &str, table: &TreeTable) -> String {
    let mut text = format!(
        "{name}: {} triangles; seconds on {} threads, best of two runs; views have 500 x 500 pixels, or fewer if they \
         would take more than 0.5 s\n",
        table.triangles, table.threads
    );
    let _ = writeln!(
        text,
        "{:10} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8} {:>8} {:>5} {:>8} {:>7} {:>8}",
        "split",
        "leaf",
        "build",
        "view 1",
        "view 2",
        "view 3",
        "view 4",
        "view 5",
        "nodes",
        "leaves",
        "depth",
        "refs/tri",
        "MB",
        "SAH cost"
    );
    for row in &table.rows {
        let (split, leaf) = plan_name(row.plan);
        let (stats, views) = (&row.stats, row.view_seconds);
        let _ = writeln!(
            text,
            "{split:10} {leaf:>7} {:7.3} {:7.4} {:7.4} {:7.4} {:7.4} {:7.4} {:8} {:8} {:5} {:8.2} {:7.1} {:8.1}",
            row.build_seconds,
            views[0],
            views[1],
            views[2],
            views[3],
            views[4],
            nodes(row),
            stats.leaves + stats.empty_leaves,
            stats.depth,
            stats.references_per_primitive(),
            stats.bytes as f64 * 1e-6,
            stats.sah_cost()
        );
    }
    let without = table.no_tree_seconds();
    let least = table.rows.iter().map(|row| row.view_seconds[0]).fold(f64::INFINITY, f64::min);
    let _ = writeln!(
        text,
        "without a tree: view 1 takes about {without:.0} s ({} rays, {:.3e} s each on one thread), {:.0} times as long\n",
        table.rays.total(),
        table.no_tree_seconds_per_ray,
        without / least
    );
    let _ = writeln!(
        text,
        "inner nodes, leaves and blocks of 16 triangles visited per ray; `expected` by the surface area heuristic should match\n\
         `lines`, which are not occluded; camera rays and bounces end at their hits\n\
         {:10} {:>7} {:>20} {:>20} {:>20} {:>20}",
        "split", "leaf", "expected", "lines", "camera", "bounces"
    );
    for row in &table.rows {
        let (split, leaf) = plan_name(row.plan);
        let three = |v: MeanVisits| format!("{:6.1} {:6.1} {:6.1}", v.inner, v.leaves, v.blocks);
        let visits = row.visits;
        let [expected, lines, camera, bounce] = [row.expected(), visits.lines, visits.camera, visits.bounce].map(three);
        let _ = writeln!(text, "{split:10} {leaf:>7} {expected} {lines} {camera} {bounce}");
    }
    text
}

fn nodes(row: &TreeRow) -> usize {
    row.stats.inner_nodes + row.stats.leaves + row.stats.empty_leaves
}

fn as_json(name: &str, table: &TreeTable) -> serde_json::Value {
    let three = |v: MeanVisits| serde_json::json!({ "inner_nodes": v.inner, "leaves": v.leaves, "blocks": v.blocks });
    let rows: Vec<_> = table
        .rows
        .iter()
        .map(|row| {
            serde_json::json!({
                "split": format!("{:?}", row.plan.preset).to_lowercase(),
                "leaf_limit": row.plan.leaf_limit,
                "build_s": row.build_seconds,
                "view_s": row.view_seconds,
                "nodes": nodes(row),
                "leaves": row.stats.leaves,
                "empty_leaves": row.stats.empty_leaves,
                "depth": row.stats.depth,
                "references_per_triangle": row.stats.references_per_primitive(),
                "bytes": row.stats.bytes,
                "sah_cost": row.stats.sah_cost(),
                "visits_per_ray": {
                    "expected": three(row.expected()),
                    "lines": three(row.visits.lines),
                    "camera": three(row.visits.camera),
                    "bounce": three(row.visits.bounce),
                },
            })
        })
        .collect();
    let rays = table.rays;
    serde_json::json!({
        "name": name,
        "triangles": table.triangles,
        "threads": table.threads,
        "rays_of_view_1": { "camera": rays.camera, "bounce": rays.bounce, "shadow": rays.shadow },
        "no_tree": { "view_1_s": table.no_tree_seconds(), "s_per_ray": table.no_tree_seconds_per_ray },
        "trees": rows,
    })
}
