//! `firstlight explain SCENE --pixel X,Y`: explains the value of a pixel, without a window.

use crate::cli::args::SceneArgs;
use crate::cli::console::{print, tell};
use crate::cli::failure::Failure;
use crate::cli::number::{between, parse_size, three_digits};
use clap::Args;
use firstlight::frame::{End, PixelStory, SnapshotNames, brightness};
use firstlight::printable;
use firstlight::render::{Integrator, RenderSettings, explain, light_traced, seen_surface};
use firstlight::scene::{Extraction, Files, FilmSize, Rendering, SceneInputs};
use glam::{DVec3, UVec2};

pub const COLUMNS: &str = "\
Columns, as luminance:
  visible   light that reaches the camera from the emitter without a bounce
  direct    light after one bounce
  indirect  light after two or more bounces
  total     their sum
  share     part of the luminance of the pixel

`sampled by` splits the light between BSDF sampling and light sampling, as weighted by multiple importance sampling.";

#[derive(Args, Clone, Debug)]
pub struct ExplainArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Pixel coordinates; 0,0 is the upper left corner.
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pixel: UVec2,
    /// Width and height of the image in pixels [default: from the scene].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Number of samples to trace.
    #[arg(long, value_name = "N", default_value_t = 64, allow_negative_numbers = true, value_parser = between::<u32>(1, 1 << 20))]
    spp: u32,
    /// Random seed [default: from the scene].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(0, u32::MAX))]
    seed: Option<u32>,
    /// Print all paths with their vertices as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &ExplainArgs) -> Result<(), Failure> {
    if let Some(size) = args.size {
        check_pixel(args.pixel, size.into())?;
    }
    let aspect = args.size.map(|(width, height)| f64::from(width) / f64::from(height));
    let scene = args.scene.load(aspect, &mut Files::default(), &|_| ())?;
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let FilmSize { width, height } = *world.resource();
    let size = args.size.map_or(UVec2::new(width, height), UVec2::from);
    check_pixel(args.pixel, size)?;
    let inputs = SceneInputs::of(&mut world);
    let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
    tell(&extraction.problems.iter().cloned().collect());
    let of_scene = world.resource::<Rendering>().0;
    // The Phong integrator has no paths; the explanation shows the light transport of the scene in any case.
    let settings =
        RenderSettings { integrator: Integrator::Path, seed: args.seed.unwrap_or(of_scene.seed), ..of_scene };
    let prepared = &extraction.prepared;
    let explanation = explain(prepared, &settings, size, args.pixel, 0..args.spp).expect("path tracing has paths");
    let light_traced = light_traced(prepared, &settings, size, args.pixel, 0..args.spp, &|| false);
    let seen = seen_surface(prepared, size, args.pixel);
    let story = PixelStory::new(&explanation, light_traced, seen, &SnapshotNames::of(&extraction, &inputs));
    if args.json { print(json(&scene.source.title(), &story)) } else { print(text(&scene.source.title(), &story)) }
}

/// Checks that the image has the pixel; if the size comes from the scene, only after loading.
fn check_pixel(UVec2 { x, y }: UVec2, size: UVec2) -> Result<(), Failure> {
    if x < size.x && y < size.y {
        return Ok(());
    }
    Err(Failure::Usage(format!(
        "--pixel: {x},{y} is outside of the image of {} x {} pixels: the last pixel is {},{}",
        size.x,
        size.y,
        size.x - 1,
        size.y - 1
    )))
}

/// As text; in luminance, since a table of three channels is hard to read.
fn text(title: &str, story: &PixelStory) -> Vec<String> {
    let mut out = Vec::new();
    let mut line = |text: String| out.push(text);
    let (UVec2 { x, y }, size) = (story.pixel, story.film_size);
    let last = story.samples.end - 1;
    line(format!("{title}: pixel {x},{y} of {} x {}, samples {} to {last}", size.x, size.y, story.samples.start));
    if story.n_bad > 0 {
        line(format!("{} of them are not finite and were discarded", story.n_bad));
    }
    surface_lines(story).into_iter().for_each(&mut line);
    if is_black(story) {
        return out;
    }
    let light_traced = story.light_traced.unwrap_or_default();
    let all = brightness(story.total());
    let share = |part: f64| if all > 0.0 { format!("{:.1} %", 100.0 * part / all) } else { "–".to_owned() };
    let width =
        story.lights.iter().map(|light| printable::name(&light.name).chars().count()).max().unwrap_or(0).max(22);
    let columns = |name: &str, cells: [String; 5]| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>13}")).collect();
        format!("  {name:width$}{cells}").trim_end().to_owned()
    };
    let row = |name: &str, parts: [DVec3; 3]| {
        let [seen, direct, indirect] = parts.map(brightness);
        let total = seen + direct + indirect;
        let figures = [seen, direct, indirect, total].map(|figure| format!("{figure:.5}"));
        let [a, b, c, d] = figures;
        columns(name, [a, b, c, d, share(total)])
    };
    line(columns("light", ["visible", "direct", "indirect", "total", "share"].map(str::to_owned)));
    for light in &story.lights {
        line(row(&printable::name(&light.name), light.parts()));
    }
    if light_traced != DVec3::ZERO {
        let total = brightness(light_traced);
        let empty = String::new;
        let cells = [empty(), empty(), empty(), format!("{total:.5}"), share(total)];
        line(columns("by light tracing", cells));
    }
    let [seen, direct, indirect] = story.parts().map(brightness);
    let cells = [seen, direct, indirect, all].map(|figure| format!("{figure:.5}"));
    let [a, b, c, d] = cells;
    line(columns("all", [a, b, c, d, share(all)]));
    let bounces: Vec<String> = (story.by_bounces.iter().enumerate())
        .map(|(bounces, radiance)| format!("{bounces}: {}", share(brightness(*radiance))))
        .collect();
    line(format!("  by bounces   {}", bounces.join("   ")));
    let (itself, asked) = (share(brightness(story.by_itself)), share(brightness(story.by_asking)));
    line(format!("  sampled by   BSDF: {itself}   light: {asked}"));
    let DVec3 { x: r, y: g, z: b } = story.total();
    line(format!("  radiance     {r:.5} {g:.5} {b:.5}, ± {:.5} in luminance", brightness(story.deviation)));
    out
}

/// Whether no sample found any light.
fn is_black(story: &PixelStory) -> bool {
    story.n_bad == 0 && story.total() == DVec3::ZERO
}

/// What the pixel shows, and whether it gets any light.
fn surface_lines(story: &PixelStory) -> Vec<String> {
    let vector = |v: DVec3| format!("({}, {}, {})", three_digits(v.x), three_digits(v.y), three_digits(v.z));
    let is_black = is_black(story);
    let Some(seen) = &story.seen else {
        let what = if is_black { "the environment, which is black here" } else { "the environment" };
        return vec![format!("  shows        {what}")];
    };
    let [object, material] = [&seen.object, &seen.material].map(|name| printable::name(name));
    let side = if seen.front { "front" } else { "back" };
    let (distance, point, normal) = (three_digits(seen.distance), vector(seen.point), vector(seen.normal));
    let mut lines = vec![
        format!("  shows        `{object}`, material `{material}`, {side}"),
        format!("  at           {distance} m, {point}, normal {normal}"),
    ];
    if is_black {
        lines.push(format!("  no light reaches it: none of {} samples found any", story.samples.len()));
    }
    lines
}

/// As JSON.
fn json(title: &str, story: &PixelStory) -> serde_json::Value {
    let rgb = |radiance: &DVec3| radiance.to_array();
    let all = |list: &[DVec3]| list.iter().map(rgb).collect::<Vec<_>>();
    let end = |end: &End| match end {
        End::At { point, what } => serde_json::json!({ "at": point.to_array(), "object": what }),
        End::Sky { direction } => serde_json::json!({ "sky": direction.to_array() }),
    };
    let lights: Vec<_> = (story.lights.iter())
        .map(|light| {
            let by_bounces = all(&light.by_bounces);
            serde_json::json!({ "name": light.name, "radiance": rgb(&light.total()), "by_bounces": by_bounces })
        })
        .collect();
    let paths: Vec<_> = (story.ways.iter())
        .map(|way| {
            let vertices: Vec<_> = (way.stops.iter())
                .map(|stop| {
                    let asked = stop.asked.as_ref().map(|(place, radiance)| {
                        serde_json::json!({ "light": end(place), "radiance": rgb(radiance) })
                    });
                    serde_json::json!({
                        "place": end(&stop.end),
                        "throughput": rgb(&stop.throughput),
                        "radiance": rgb(&stop.radiance),
                        "asked": asked,
                    })
                })
                .collect();
            serde_json::json!({
                "sample": way.sample, "radiance": rgb(&way.radiance), "origin": way.origin.to_array(), "vertices": vertices,
            })
        })
        .collect();
    serde_json::json!({
        "scene": title,
        "pixel": story.pixel.to_array(),
        "size": story.film_size.to_array(),
        "samples": [story.samples.start, story.samples.end],
        "bad_samples": story.n_bad,
        "surface": story.seen.as_ref().map(|seen| serde_json::json!({
            "object": seen.object, "material": seen.material, "front": seen.front, "distance": seen.distance,
            "point": seen.point.to_array(), "normal": seen.normal.to_array(),
        })),
        "radiance": rgb(&story.total()),
        "deviation": rgb(&story.deviation),
        "lights": lights,
        "by_bounces": all(&story.by_bounces),
        "by_running_into_it": rgb(&story.by_itself),
        "by_asking": rgb(&story.by_asking),
        "by_paths_from_the_lamps": story.light_traced.as_ref().map(rgb),
        "paths": paths,
    })
}

/// Parses `640,360` as a pixel.
fn parse_pixel(text: &str) -> Result<UVec2, String> {
    let wrong = || format!("`{text}` is not a pixel: expected X,Y, such as 640,360");
    let (x, y) = text.split_once(',').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    Ok(UVec2::new(number(x)?, number(y)?))
}
