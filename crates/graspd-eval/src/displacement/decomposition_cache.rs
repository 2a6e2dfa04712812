//! Convex decompositions on disk: they take seconds to make, and every run on the same object needs the same.

use graspd_geom::{CacheKey, DiskCache, TriangleMesh};
use nalgebra::Point3;

use super::convex_piece::ConvexPiece;
use super::decomposition::{DecompositionSettings, ObjectPieces};

/// Counts up whenever the same mesh and settings give other pieces, be it by parry's convex hulls, or these are
/// stored in another way.
const VERSION: u32 = 1;

impl ObjectPieces {
    /// As [`ObjectPieces::new`], but taken from the cache if it holds them, and else stored there; the result is the
    /// same to the last bit.
    pub fn new_cached(
        mesh: &TriangleMesh,
        signed_distance: &dyn Fn(&Point3<f64>) -> f64,
        settings: &DecompositionSettings,
        cache: &DiskCache,
    ) -> Self {
        let key = key(mesh, settings);
        let stored = cache.load(&key);
        if let Some(pieces) = stored.and_then(|bytes| from_bytes(&bytes)) {
            return pieces;
        }
        let pieces = Self::new(mesh, signed_distance, settings);
        cache.store(&key, &to_bytes(&pieces));
        pieces
    }
}

/// What a decomposition depends on; the signed distance follows from the mesh.
fn key(mesh: &TriangleMesh, settings: &DecompositionSettings) -> CacheKey {
    let DecompositionSettings {
        overfill_tolerance,
        simplification_tolerance,
        max_pieces,
    } = *settings;
    CacheKey::new("convex-pieces", VERSION)
        .with_count(max_pieces)
        .with_numbers([overfill_tolerance, simplification_tolerance])
        .with_numbers(mesh.vertices.iter().flat_map(|p| [p.x, p.y, p.z]))
        .with_numbers(mesh.faces.iter().flatten().map(|index| f64::from(*index)))
}

/// Overfill, volume, the number of pieces; for each its numbers of vertices and faces, and these. Little-endian.
fn to_bytes(pieces: &ObjectPieces) -> Vec<u8> {
    let mut bytes = Vec::new();
    let count = |bytes: &mut Vec<u8>, count: usize| bytes.extend((count as u64).to_le_bytes());
    for number in [pieces.overfill, pieces.volume] {
        bytes.extend(number.to_le_bytes());
    }
    count(&mut bytes, pieces.pieces.len());
    for ConvexPiece { vertices, faces } in &pieces.pieces {
        count(&mut bytes, vertices.len());
        count(&mut bytes, faces.len());
        bytes.extend(vertices.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend(faces.iter().flatten().flat_map(|index| index.to_le_bytes()));
    }
    bytes
}

/// `None` if that is no decomposition.
fn from_bytes(bytes: &[u8]) -> Option<ObjectPieces> {
    let mut rest = bytes;
    let mut eight = || {
        let (eight, tail) = rest.split_first_chunk::<8>()?;
        rest = tail;
        Some(*eight)
    };
    let [overfill, volume] = [f64::from_le_bytes(eight()?), f64::from_le_bytes(eight()?)];
    let count = u64::from_le_bytes(eight()?);
    let mut pieces = Vec::new();
    for _ in 0..count {
        let (piece, tail) = piece_from(rest)?;
        pieces.push(piece);
        rest = tail;
    }
    rest.is_empty().then_some(ObjectPieces {
        pieces,
        overfill,
        volume,
    })
}

/// One piece, and the bytes after it.
fn piece_from(bytes: &[u8]) -> Option<(ConvexPiece, &[u8])> {
    let (counts, rest) = bytes.split_at_checked(16)?;
    let (vertices, faces) = counts.split_at(8);
    let len = |count: &[u8], size: usize| {
        let count = u64::from_le_bytes(count.try_into().ok()?);
        usize::try_from(count).ok()?.checked_mul(size)
    };
    let (vertices, rest) = rest.split_at_checked(len(vertices, 24)?)?;
    let (faces, rest) = rest.split_at_checked(len(faces, 12)?)?;
    let number = |bytes: &[u8]| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes);
    let index = |bytes: &[u8]| bytes.try_into().map_or(u32::MAX, u32::from_le_bytes);
    let piece = ConvexPiece {
        vertices: (vertices.chunks_exact(24))
            .map(|p| [number(&p[..8]), number(&p[8..16]), number(&p[16..])])
            .collect(),
        faces: (faces.chunks_exact(12))
            .map(|face| [index(&face[..4]), index(&face[4..8]), index(&face[8..])])
            .collect(),
    };
    let is_sound = piece.vertices.iter().flatten().all(|x| x.is_finite())
        && (piece.faces.iter().flatten()).all(|index| (*index as usize) < piece.vertices.len());
    is_sound.then_some((piece, rest))
}

#[cfg(test)]
mod tests {
    use graspd_geom::SignedDistance;
    use graspd_mesh::builtin_object;

    use super::*;

    #[test]
    fn pieces_from_the_cache_have_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let cache = DiskCache::new(folder.path(), DiskCache::USUAL_CAPACITY);
        let mesh = builtin_object("box").unwrap();
        let surface = SignedDistance::new(&mesh).unwrap();
        let coarse = DecompositionSettings {
            overfill_tolerance: 2e-3,
            max_pieces: 8,
            ..Default::default()
        };
        let coarser = DecompositionSettings {
            max_pieces: 2,
            ..coarse.clone()
        };
        for (at, settings) in [&coarse, &coarser].into_iter().enumerate() {
            let distance = |p: &Point3<f64>| surface.signed_distance(p);
            let made = ObjectPieces::new(&mesh, &distance, settings);
            let stored = ObjectPieces::new_cached(&mesh, &distance, settings, &cache);
            // The second time nothing is computed.
            let loaded = ObjectPieces::new_cached(&mesh, &|_| f64::NAN, settings, &cache);
            assert_eq!(made, stored);
            assert_eq!(made, loaded);
            assert_eq!(cache.size().unwrap().files, at + 1);
        }
        let mut moved = mesh.clone();
        moved.vertices[0].x += 1e-9;
        let distance = |p: &Point3<f64>| surface.signed_distance(p);
        ObjectPieces::new_cached(&moved, &distance, &coarse, &cache);
        assert_eq!(cache.size().unwrap().files, 3);
        assert!(cache.fault().is_none());
    }

    #[test]
    fn what_is_no_decomposition_is_refused() {
        let piece = ConvexPiece {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        };
        let pieces = ObjectPieces {
            pieces: vec![piece.clone(), piece],
            overfill: 1e-4,
            volume: 0.1,
        };
        let bytes = to_bytes(&pieces);
        assert_eq!(from_bytes(&bytes).as_ref(), Some(&pieces));
        for len in 0..bytes.len() {
            assert_eq!(from_bytes(&bytes[..len]), None, "cut to {len} bytes");
        }
        assert_eq!(from_bytes(&[&bytes[..], &[0]].concat()), None);
        // More pieces, vertices or faces than there are bytes.
        for at in [16, 24, 32] {
            let mut bytes = bytes.clone();
            bytes[at..at + 8].copy_from_slice(&u64::MAX.to_le_bytes());
            assert_eq!(from_bytes(&bytes), None);
        }
        // An index that no vertex has.
        let mut bytes = bytes;
        let last = bytes.len() - 1;
        bytes[last] = 255;
        assert_eq!(from_bytes(&bytes), None);
    }
}
