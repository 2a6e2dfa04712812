//! The cache of computed results: what it gives back, and what damage, strangers and full disks do to it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use graspd_geom::{CacheKey, CacheSize, DiskCache, SdfGrid, SdfSampling, SignedDistance};
use graspd_mesh::builtin_object;
use tempfile::tempdir;

fn key(number: f64) -> CacheKey {
    CacheKey::new("test", 1).with_numbers([number])
}

fn cache(folder: &Path) -> DiskCache {
    DiskCache::new(folder, DiskCache::USUAL_CAPACITY)
}

/// The files of a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn keys_differ_in_kind_version_and_every_input() {
    let folder = tempdir().unwrap();
    let cache = cache(folder.path());
    let keys = [
        CacheKey::new("a", 1),
        CacheKey::new("b", 1),
        CacheKey::new("a", 2),
        CacheKey::new("a", 12),
        CacheKey::new("a", 1).with_count(0),
        CacheKey::new("a", 1).with_count(1),
        CacheKey::new("a", 1).with_numbers([]).with_count(1),
        CacheKey::new("a", 1).with_numbers([0.0]),
        CacheKey::new("a", 1).with_numbers([-0.0]),
        CacheKey::new("a", 1).with_numbers([0.0, 0.0]),
        CacheKey::new("a", 1)
            .with_numbers([0.0])
            .with_numbers([0.0]),
    ];
    for (at, key) in keys.iter().enumerate() {
        assert_eq!(cache.load(key), None, "{key:?}");
        cache.store(key, &[at as u8]);
    }
    for (at, key) in keys.iter().enumerate() {
        assert_eq!(cache.load(key), Some(vec![at as u8]));
    }
    assert_eq!(cache.size().unwrap().files, keys.len());
    assert!(cache.fault().is_none());
}

#[test]
fn damaged_entries_are_absent_and_get_replaced() {
    let folder = tempdir().unwrap();
    let cache = cache(folder.path());
    cache.store(&key(1.0), b"content");
    let file = &files(folder.path())[0];
    let whole = fs::read(file).unwrap();
    for len in 0..whole.len() {
        fs::write(file, &whole[..len]).unwrap();
        assert_eq!(cache.load(&key(1.0)), None, "cut to {len} bytes");
    }
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1;
        fs::write(file, bytes).unwrap();
        assert_eq!(cache.load(&key(1.0)), None, "byte {at} altered");
    }
    fs::write(file, [&whole[..], b"!"].concat()).unwrap();
    assert_eq!(cache.load(&key(1.0)), None);
    cache.store(&key(1.0), b"content");
    assert_eq!(cache.load(&key(1.0)), Some(b"content".to_vec()));

    // Another's entry under this name.
    cache.store(&key(2.0), b"other");
    let other = files(folder.path()).into_iter().find(|path| path != file);
    fs::rename(other.unwrap(), file).unwrap();
    assert_eq!(cache.load(&key(1.0)), None);
    // A folder in its place.
    fs::remove_file(file).unwrap();
    fs::create_dir(file).unwrap();
    assert_eq!(cache.load(&key(1.0)), None);
}

#[test]
fn what_was_used_last_is_kept() {
    let folder = tempdir().unwrap();
    let content = [7; 1000];
    let cache = DiskCache::new(folder.path(), 3500);
    for number in [1.0, 2.0, 3.0] {
        cache.store(&key(number), &content);
        // As if it had been long ago.
        for file in files(folder.path()) {
            let file = fs::File::options().append(true).open(file).unwrap();
            let used = file.metadata().unwrap().modified().unwrap();
            file.set_modified(used - Duration::from_secs(60)).unwrap();
        }
    }
    assert!(cache.load(&key(1.0)).is_some());
    cache.store(&key(4.0), &content);
    assert_eq!(cache.load(&key(2.0)), None);
    for number in [1.0, 3.0, 4.0] {
        assert!(cache.load(&key(number)).is_some(), "{number}");
    }
    // What is larger than all that may be kept drives nothing out.
    cache.store(&key(5.0), &[7; 4000]);
    assert_eq!(cache.load(&key(5.0)), None);
    assert_eq!(cache.size().unwrap().files, 3);
    assert!(cache.fault().is_none());
}

#[test]
fn unfinished_entries_go_when_they_are_old() {
    let folder = tempdir().unwrap();
    let cache = cache(folder.path());
    cache.store(&key(1.0), b"content");
    let name = files(folder.path())[0].file_name().unwrap().to_owned();
    let [fresh, old] = ["1-0", "2-0"].map(|process| {
        let name = format!(".{}.{process}.part", name.to_string_lossy());
        folder.path().join(name)
    });
    fs::write(&fresh, "half").unwrap();
    fs::write(&old, "half").unwrap();
    let yesterday = SystemTime::now() - Duration::from_secs(86400);
    let handle = fs::File::options().append(true).open(&old).unwrap();
    handle.set_modified(yesterday).unwrap();
    cache.store(&key(2.0), b"content");
    assert!(fresh.exists() && !old.exists());
}

#[test]
fn clearing_leaves_what_is_not_ours() {
    let folder = tempdir().unwrap();
    let cache = cache(folder.path());
    let stranger = folder.path().join("notes.txt");
    fs::write(&stranger, "mine").unwrap();
    cache.store(&key(1.0), b"content");
    cache.store(&key(2.0), b"content");
    let size = cache.size().unwrap();
    assert_eq!(size.files, 2);
    assert_eq!(cache.clear().unwrap(), size);
    assert_eq!(files(folder.path()), [stranger]);
    assert_eq!(
        DiskCache::new("/nowhere/at/all", 1).clear().unwrap(),
        CacheSize::default()
    );
}

#[test]
fn a_folder_that_cannot_be_used_is_a_fault_and_no_failure() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let mut places = vec![file.join("cache"), file];
    if Path::new("/proc/self").exists() {
        // Not even the superuser can write there.
        places.push("/proc/graspd".into());
    }
    let surface = SignedDistance::new(&builtin_object("box").unwrap()).unwrap();
    let exact = SdfGrid::build(&surface, 12, 0.01, &|_| {}).unwrap();
    for place in places {
        let cache = cache(&place);
        let sampling = SdfSampling::exact(12, 0.01);
        let grid = SdfGrid::sample_cached(&surface, &sampling, &cache, &|_| {}).unwrap();
        assert!(grid == exact);
        let fault = cache.fault().map(ToString::to_string).unwrap_or_default();
        assert!(
            fault.contains(&*place.to_string_lossy()),
            "{}: {fault}",
            place.display()
        );
    }
}

#[test]
fn many_writers_and_readers_never_meet_half_an_entry() {
    let folder = tempdir().unwrap();
    let contents: Vec<Vec<u8>> = (0..4_u8).map(|byte| vec![byte; 100_000]).collect();
    std::thread::scope(|scope| {
        for content in &contents {
            // As different processes would have, each has its own.
            let cache = cache(folder.path());
            let contents = &contents;
            scope.spawn(move || {
                for _ in 0..50 {
                    cache.store(&key(1.0), content);
                    // A file that is renamed over another is whole at every moment.
                    assert!(contents.contains(&cache.load(&key(1.0)).unwrap()));
                }
                assert!(cache.fault().is_none());
            });
        }
    });
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn grids_from_the_cache_have_the_same_bits() {
    let folder = tempdir().unwrap();
    let cache = cache(folder.path());
    let [mug, can] =
        ["mug", "can"].map(|name| SignedDistance::new(&builtin_object(name).unwrap()).unwrap());
    let exact = SdfSampling::exact(20, 0.01);
    let banded = SdfSampling {
        band: Some(0.01),
        ..exact
    };
    let cases = [
        (&mug, exact),
        (&can, exact),
        (&mug, banded),
        (&mug, SdfSampling::exact(21, 0.01)),
        (&mug, SdfSampling::exact(20, 0.02)),
    ];
    for (at, (surface, sampling)) in cases.iter().enumerate() {
        let grid = SdfGrid::sample(surface, sampling, &|_| {}).unwrap();
        for _ in 0..2 {
            let cached = SdfGrid::sample_cached(surface, sampling, &cache, &|_| {}).unwrap();
            assert!(cached == grid, "{sampling:?}");
            assert_eq!(cache.size().unwrap().files, at + 1);
        }
        // Damaged, it is made again.
        for file in files(folder.path()) {
            let bytes = fs::read(&file).unwrap();
            fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        }
        let again = SdfGrid::sample_cached(surface, sampling, &cache, &|_| {}).unwrap();
        assert!(again == grid);
    }
    assert!(cache.fault().is_none());
}
