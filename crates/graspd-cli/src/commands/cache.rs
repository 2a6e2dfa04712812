//! `graspd cache`, and the flags by which other commands choose where results are kept between runs.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use graspd_geom::{CacheSize, DiskCache};

use crate::console::{print, print_json, warn};

/// Where distance grids and convex decompositions are kept between runs.
#[derive(Args, Default)]
pub(crate) struct CacheChoice {
    /// Keep distance grids and decompositions in this folder (GRASPD_CACHE_DIR, or the user's cache, by default)
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    /// Compute everything, and keep nothing for the next run; results are the same
    #[arg(long, conflicts_with = "cache_dir")]
    no_cache: bool,
}

impl CacheChoice {
    /// Opens the cache, if there is to be one and there is a place for it.
    pub(crate) fn open(&self) -> Option<DiskCache> {
        if self.no_cache {
            return None;
        }
        open(self.cache_dir.as_ref())
    }

    /// Warns if something is wrong with the cache; the results are right all the same.
    pub(crate) fn tell_fault(cache: Option<&DiskCache>, quiet: bool) {
        if let Some(fault) = cache.and_then(DiskCache::fault) {
            let remedy = "only the next run is slower for it; --cache-dir names another folder";
            warn(quiet, &format!("the cache is of no use: {fault}; {remedy}"));
        }
    }
}

fn open(folder: Option<&PathBuf>) -> Option<DiskCache> {
    let folder = folder.cloned().or_else(DiskCache::user_folder)?;
    Some(DiskCache::new(folder, DiskCache::USUAL_CAPACITY))
}

#[derive(Args)]
pub(crate) struct Arguments {
    /// Remove all of it
    #[arg(long)]
    clear: bool,
    /// The folder (GRASPD_CACHE_DIR, or the user's cache, by default)
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let cache = open(arguments.cache_dir.as_ref())
        .context("this user has no folder for caches; set GRASPD_CACHE_DIR or HOME")?;
    let CacheSize { files, bytes } = if arguments.clear {
        cache.clear()?
    } else {
        cache.size()?
    };
    let folder = cache.folder().display();
    if arguments.json {
        return print_json(&serde_json::json!({
            "folder": cache.folder().to_string_lossy(),
            "files": files,
            "bytes": bytes,
            "most_bytes": DiskCache::USUAL_CAPACITY,
            "cleared": arguments.clear,
        }));
    }
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let what = format!("{files} files, {:.1} MiB", mebibytes(bytes));
    let most = mebibytes(DiskCache::USUAL_CAPACITY);
    print(&if arguments.clear {
        format!("{folder}: removed {what}\n")
    } else {
        format!("{folder}: {what} (at most {most:.0}; --clear removes them)\n")
    })
}
