//! `firstlight stability`: runs the hard cases and prints the counts, as a table or as JSON. Fails if there are
//! findings.

use crate::cli::console::{Bar, lines, print};
use crate::cli::failure::Failure;
use crate::cli::number::between;
use clap::Args;
use firstlight::render::worker_threads;
use firstlight::report::cpu_seconds;
use firstlight::stability::{CASES, Case, Tally, Worst};
use std::time::Instant;

/// Default number of rays of the largest case.
const USUAL_RAYS: u64 = 10_000_000;

#[derive(Args, Clone, Debug)]
pub struct StabilityArgs {
    /// Approximate number of rays of the largest case; the others trace a fixed share of it, but at least their minimum.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = USUAL_RAYS, value_parser = parse_rays)]
    rays: u64,
    /// Run only this case; may be repeated.
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// List the cases.
    #[arg(long, conflicts_with_all = ["cases", "replay"])]
    list: bool,
    /// Trace one ray of a case in detail, as named by a finding; use the same --rays as the finding.
    #[arg(long, requires = "cases", value_name = "SCENE:RAY", value_parser = parse_ray)]
    replay: Option<(usize, u64)>,
    /// Number of worker threads [default: all cores]; the counts do not depend on it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u16>(1, 1024))]
    threads: Option<u16>,
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &StabilityArgs) -> Result<(), Failure> {
    if args.list {
        return list(args.json);
    }
    let cases = chosen(args)?;
    if let Some((test_scene, ray)) = args.replay {
        return replay(args, &cases, test_scene, ray);
    }
    let pool = worker_threads()
        .num_threads(args.threads.map_or(0, usize::from))
        .build()
        .map_err(|error| Failure::Failed(format!("cannot start worker threads: {error}")))?;
    pool.install(|| count(args, &cases))
}

fn list(as_json: bool) -> Result<(), Failure> {
    if as_json {
        let case =
            |case: &Case| serde_json::json!({ "case": case.name, "about": case.about, "replay": case.can_replay() });
        return print(serde_json::json!({ "cases": CASES.iter().map(case).collect::<Vec<_>>() }));
    }
    let width = CASES.iter().map(|case| case.name.len()).max().unwrap_or(0);
    CASES.iter().try_for_each(|case| print(format_args!("{:width$}  {}", case.name, case.about)))
}

fn replay(args: &StabilityArgs, cases: &[&Case], test_scene: usize, ray: u64) -> Result<(), Failure> {
    let [case] = cases else {
        return Err(Failure::Usage("--replay needs exactly one --case NAME".to_owned()));
    };
    let told = case.replay(test_scene, ray, args.rays);
    let told = told.map_err(|error| Failure::Usage(format!("--replay: {}: {error}", case.name)))?;
    if !args.json {
        return print(lines(&told.to_string()));
    }
    let rows = told.rows().map(|(label, value)| (label.to_owned(), value.json()));
    let mut object: serde_json::Map<_, _> = rows.collect();
    object.insert("case".to_owned(), case.name.into());
    object.insert("replay".to_owned(), format!("{test_scene}:{ray}").into());
    print(serde_json::Value::from(object))
}

/// The arguments that replay the ray of a finding.
fn replay_args(args: &StabilityArgs, case: &Case, worst: &Worst) -> String {
    let rays = if args.rays == USUAL_RAYS { String::new() } else { format!(" --rays {}", args.rays) };
    format!("--case {} --replay {}:{}{rays}", case.name, worst.test_scene, worst.ray)
}

fn chosen(args: &StabilityArgs) -> Result<Vec<&'static Case>, Failure> {
    if args.cases.is_empty() {
        return Ok(CASES.iter().collect());
    }
    let find = |name: &String| {
        let hint = || firstlight::scene::suggestion(name, CASES.iter().map(|case| case.name));
        Case::find(name).ok_or_else(|| Failure::Usage(format!("unknown case `{name}`{}; see --list", hint())))
    };
    args.cases.iter().map(find).collect()
}

fn count(args: &StabilityArgs, cases: &[&Case]) -> Result<(), Failure> {
    let total: u64 = cases.iter().map(|case| case.rays(args.rays)).sum();
    let bar = Bar::new(total);
    if !args.json {
        print(lines(HEAD.trim_end()))?;
    }
    let (start, cpu_before) = (Instant::now(), cpu_seconds());
    let mut rows = Vec::new();
    let mut before = 0;
    for case in cases {
        bar.set_message(case.name);
        bar.set_position(before);
        let clock = Instant::now();
        let tally = case.run(args.rays, &|rays| bar.inc(rays));
        before += case.rays(args.rays);
        if !args.json {
            bar.suspend(|| print(row(case, &tally).trim_end()))?;
        }
        rows.push((case, tally, clock.elapsed().as_secs_f64()));
    }
    bar.finish_and_clear();
    let cpu = cpu_seconds().zip(cpu_before).map(|(after, before)| after - before);
    let findings: u64 = rows.iter().map(|(_, tally, _)| tally.findings()).sum();
    let rays: u64 = rows.iter().map(|(_, tally, _)| tally.rays).sum();
    if args.json {
        let cases: Vec<_> = rows.iter().map(|(case, tally, seconds)| json(args, case, tally, *seconds)).collect();
        let seconds = start.elapsed().as_secs_f64();
        print(
            serde_json::json!({ "cases": cases, "rays": rays, "findings": findings, "seconds": seconds, "cpu_s": cpu }),
        )?;
    } else {
        let seconds = start.elapsed().as_secs_f64();
        print(vec![String::new(), format!("{rays} rays, {findings} findings, {seconds:.0} s")])?;
        for (case, tally, _) in rows.iter().filter(|(_, tally, _)| tally.findings() > 0) {
            let Some(worst) = &tally.worst else { continue };
            print(vec![String::new(), format!("worst of {}: {}", case.name, worst.what)])?;
            if case.can_replay() {
                print(format_args!("  firstlight stability {}", replay_args(args, case, worst)))?;
            }
        }
    }
    if findings > 0 { Err(Failure::Failed(format!("{findings} findings"))) } else { Ok(()) }
}

const HEAD: &str = "\
| case            |          rays | leaks | acne | missed | wrong t | non-finite | above | light error (allowed) | worst of bound |
|-----------------|--------------:|------:|-----:|-------:|--------:|-----------:|------:|----------------------:|---------------:|
";

fn row(case: &Case, tally: &Tally) -> String {
    let Tally { rays, leaks, acne, missed, wrong_t, non_finite, above, energy, worst } = tally;
    let light = energy.map_or(String::new(), |energy| format!("{:.1e} ({:.0e})", energy.error, energy.allowed));
    let worst = worst.as_ref().map_or(String::new(), |worst| format!("{:.2}", worst.severity));
    format!(
        "| {:15} | {rays:13} | {leaks:5} | {acne:4} | {missed:6} | {wrong_t:7} | {non_finite:10} | {above:5} | {light:>21} | {worst:>14} |\n",
        case.name
    )
}

fn json(args: &StabilityArgs, case: &Case, tally: &Tally, seconds: f64) -> serde_json::Value {
    let energy = tally.energy.map(|energy| serde_json::json!({ "error": energy.error, "allowed": energy.allowed }));
    let worst = tally.worst.as_ref().map(|worst| {
        let replay = case.can_replay().then(|| replay_args(args, case, worst));
        serde_json::json!({ "severity": worst.severity, "what": worst.what, "replay": replay })
    });
    serde_json::json!({
        "case": case.name,
        "rays": tally.rays,
        "leaks": tally.leaks,
        "acne": tally.acne,
        "missed": tally.missed,
        "wrong_t": tally.wrong_t,
        "non_finite": tally.non_finite,
        "above_bound": tally.above,
        "energy": energy,
        "worst": worst,
        "findings": tally.findings(),
        "seconds": seconds,
    })
}

/// Parses an integer that may be written as 1e9.
fn parse_rays(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(rays) if (1.0..=1e15).contains(&rays) => Ok(rays as u64),
        _ => Err("expected a number of rays from 1 to 1e15, such as 1e8".to_owned()),
    }
}

fn parse_ray(text: &str) -> Result<(usize, u64), String> {
    let parsed = text.split_once(':').and_then(|(test_scene, ray)| Some((test_scene.parse().ok()?, ray.parse().ok()?)));
    parsed.ok_or_else(|| "expected SCENE:RAY as printed by a finding, such as 12:345".to_owned())
}
