//! `graspd gws`: epsilon and volume of any set of wrenches.

use std::io::Read;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow, bail};
use clap::Args;
use graspd_eval::{
    Epsilon, EpsilonSettings, VolumeMethod, VolumeSettings, ferrari_canny, hull_volume,
};
use graspd_settings::between;

use crate::console::{print, print_json};

/// What a file must look like.
const FORMAT: &str = "six numbers fx,fy,fz,tx,ty,tz separated by commas";
/// More wrenches than any grasp has; they would fill the memory.
const MAX_WRENCHES: usize = 1_000_000;
/// Bytes of a file of that many wrenches with all their digits.
const MAX_BYTES: u64 = 256 << 20;

#[derive(Args)]
pub(crate) struct Arguments {
    /// One wrench fx,fy,fz,tx,ty,tz a line, after a line of column names or none; - reads the standard input
    wrenches: PathBuf,
    /// Wrenches a contact: limit each contact's coefficients to a sum of 1 (L-infinity) instead of all together (L1)
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    per_contact: Option<u32>,
    /// Half width of an estimated volume's 95 % interval, relative to it
    #[arg(long, default_value_t = VolumeSettings::default().relative_half_width, value_name = "FRACTION")]
    volume_accuracy: f64,
    /// Seed of an estimated volume
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let name = arguments.wrenches.display().to_string();
    let accuracy = arguments.volume_accuracy;
    between(1e-4, 1.0).check("--volume-accuracy", &accuracy)?;
    let text = read(arguments).with_context(|| {
        format!("{name}: cannot be read; name a text file with {FORMAT} on each line")
    })?;
    let wrenches = parse(&text).map_err(|error| anyhow!("{name}: {error}"))?;
    let settings = match arguments.per_contact {
        None => EpsilonSettings::sum(),
        Some(count) => {
            let count = count as usize;
            if !wrenches.len().is_multiple_of(count) {
                bail!(
                    "{name}: {} wrenches are no whole number of contacts of {count}; correct --per-contact or the \
                     file",
                    wrenches.len()
                );
            }
            EpsilonSettings::each(count)
        }
    };
    let volume_settings = VolumeSettings {
        relative_half_width: accuracy,
        // A hundred times the accuracy takes ten thousand times the directions.
        max_directions: 1_000_000,
        seed: arguments.seed,
        ..VolumeSettings::default()
    };
    let epsilon = ferrari_canny(&wrenches, &settings).with_context(|| name.clone())?;
    let volume = hull_volume(&wrenches, &volume_settings).with_context(|| name.clone())?;
    let is_exact = volume.method == VolumeMethod::Exact;
    if arguments.json {
        return print_json(&serde_json::json!({
            "wrenches": wrenches.len(),
            "force_limit": settings.limit,
            "epsilon": epsilon.value,
            "epsilon_lower": epsilon.lower,
            "epsilon_upper": epsilon.upper,
            "epsilon_reason": epsilon.reason.map(|reason| reason.to_string()),
            "volume": volume.value,
            "volume_lower": volume.lower,
            "volume_upper": volume.upper,
            "volume_method": if is_exact { "exact" } else { "sampled" },
        }));
    }
    let Epsilon {
        value,
        lower,
        upper,
        reason,
    } = &epsilon;
    let why = reason
        .as_ref()
        .map_or_else(String::new, |reason| format!("  ({reason})"));
    let accuracy = if is_exact {
        "exact".into()
    } else {
        format!("95 % within [{:.6}, {:.6}]", volume.lower, volume.upper)
    };
    print(&format!(
        "wrenches {}\nepsilon  {value:.12}  within [{lower:.12}, {upper:.12}]{why}\nvolume   {:.12}  {accuracy}\n",
        wrenches.len(),
        volume.value
    ))
}

fn read(arguments: &Arguments) -> Result<String> {
    let source: Box<dyn Read> = if arguments.wrenches.as_os_str() == "-" {
        Box::new(std::io::stdin())
    } else {
        Box::new(std::fs::File::open(&arguments.wrenches)?)
    };
    let mut bytes = Vec::new();
    source.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        bail!("it is larger than {} MB", MAX_BYTES >> 20);
    }
    Ok(String::from_utf8(bytes)?)
}

/// Parses the wrenches of a file; blank lines and a first line of column names do not count.
fn parse(text: &str) -> Result<Vec<[f64; 6]>> {
    let mut wrenches = Vec::new();
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty()).peekable();
    if lines.peek().is_some_and(|(_, line)| is_header(line)) {
        lines.next();
    }
    for (index, line) in lines {
        let number = index + 1;
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let &[fx, fy, fz, tx, ty, tz] = fields.as_slice() else {
            bail!("line {number}: {} fields; write {FORMAT}", fields.len());
        };
        let mut wrench = [0.0; 6];
        for (value, field) in wrench.iter_mut().zip([fx, fy, fz, tx, ty, tz]) {
            *value = field
                .parse()
                .ok()
                .filter(|x: &f64| x.is_finite())
                .ok_or_else(|| {
                    anyhow!("line {number}: `{field:.40}` is not a finite number; write {FORMAT}")
                })?;
        }
        if wrenches.len() == MAX_WRENCHES {
            bail!("more than {MAX_WRENCHES} wrenches; leave out those of contacts close to others");
        }
        wrenches.push(wrench);
    }
    Ok(wrenches)
}

/// Returns whether the line names six columns: no field of it is a number.
fn is_header(line: &str) -> bool {
    let mut fields = line.split(',');
    line.split(',').count() == 6 && fields.all(|field| field.trim().parse::<f64>().is_err())
}
