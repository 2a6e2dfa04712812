//! The hyperplane through D points, by Householder reflections.

/// An oriented hyperplane `normal . x = offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hyperplane<const D: usize> {
    pub(super) normal: [f64; D],
    pub(super) offset: f64,
    /// (D-1)! times the measure of the simplex that spans it; 0 where nobody asked.
    pub(super) determinant: f64,
    /// How far off heights above it may be; 0 where nobody asked.
    pub(super) uncertainty: f64,
}

/// Sum of products.
#[inline(always)]
pub(super) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let mut sum = 0.0;
    for k in 0..D {
        sum += a[k] * b[k];
    }
    sum
}

/// a - b
#[inline(always)]
pub(super) fn difference<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// The hyperplane through `corners`, oriented so that `det(p_1 - p_0, ..., p_{D-1} - p_0, normal) > 0`.
///
/// The edge vectors are brought to triangular form by reflections: `E = Q R`. The last column of Q is
/// orthogonal to all of them, and the product of R's diagonal is (D-1)! times the simplex's measure. This is
/// backward stable, so even a thin simplex gets the normal of one within rounding of it.
/// `None` where the corners are affinely dependent.
#[inline]
pub(super) fn hyperplane<const D: usize>(corners: &[&[f64; D]; D]) -> Option<Hyperplane<D>> {
    // Row j holds edge j, and from step j on the reflection's vector, zero in its first j entries.
    let mut rows = [[0.0; D]; D];
    for j in 0..D - 1 {
        rows[j] = difference(corners[j + 1], corners[0]);
    }
    let mut factors = [0.0; D];
    let mut product = 1.0;
    for j in 0..D - 1 {
        let mut reflector = rows[j];
        for entry in reflector.iter_mut().take(j) {
            *entry = 0.0;
        }
        let length = dot(&reflector, &reflector).sqrt();
        let pivot = reflector[j];
        let scale = length * (length + pivot.abs());
        if scale < f64::MIN_POSITIVE {
            return None;
        }
        // Reflection 1 - factor v v^T sends the edge to -sign(pivot) length e_j, and its determinant is -1.
        let factor = 1.0 / scale;
        let image = -length.copysign(pivot);
        reflector[j] = pivot - image;
        for row in rows.iter_mut().take(D - 1).skip(j + 1) {
            let amount = factor * dot(&reflector, row);
            for k in 0..D {
                row[k] -= amount * reflector[k];
            }
        }
        rows[j] = reflector;
        factors[j] = factor;
        product *= -image;
    }
    let mut normal = [0.0; D];
    normal[D - 1] = 1.0f64.copysign(product);
    for j in (0..D - 1).rev() {
        let amount = factors[j] * dot(&rows[j], &normal);
        for k in 0..D {
            normal[k] -= amount * rows[j][k];
        }
    }
    let offset = dot(&normal, corners[0]);
    Some(Hyperplane {
        normal,
        offset,
        determinant: product.abs(),
        uncertainty: 0.0,
    })
}

/// The hyperplane from a normal of any length that has the orientation and the length of the determinant above.
pub(super) fn hyperplane_of_minors<const D: usize>(
    minors: &[f64; D],
    corner: &[f64; D],
) -> Hyperplane<D> {
    let length = dot(minors, minors).sqrt();
    let normal = minors.map(|minor| minor / length);
    Hyperplane {
        normal,
        offset: dot(&normal, corner),
        determinant: length,
        uncertainty: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_in_space_has_the_normal_of_its_winding_and_twice_its_area() {
        let corners = [&[2.0, 0.0, 5.0], &[2.0, 3.0, 5.0], &[6.0, 0.0, 5.0]];
        let plane = hyperplane(&corners).expect("a proper triangle");
        // (0,3,0) x (4,0,0) = (0,0,-12)
        assert_eq!(plane.normal.map(f64::round), [0.0, 0.0, -1.0]);
        assert!((plane.determinant - 12.0).abs() < 1e-14);
        assert!((plane.offset + 5.0).abs() < 1e-14);
    }

    #[test]
    fn the_standard_simplex_has_a_diagonal_normal_in_every_dimension() {
        fn check<const D: usize>() {
            let unit: [[f64; D]; D] =
                std::array::from_fn(|j| std::array::from_fn(|k| f64::from(u8::from(j == k))));
            let plane = hyperplane(&unit.each_ref()).expect("a proper simplex");
            let root = (D as f64).sqrt();
            for k in 0..D {
                assert!((plane.normal[k].abs() - 1.0 / root).abs() < 1e-15);
            }
            assert!((plane.determinant - root).abs() < 1e-15);
        }
        check::<2>();
        check::<3>();
        check::<4>();
        check::<5>();
        check::<6>();
    }

    #[test]
    fn dependent_corners_have_no_hyperplane() {
        let corners = [&[0.0, 0.0, 0.0], &[1.0, 1.0, 1.0], &[0.0, 0.0, 0.0]];
        assert!(hyperplane(&corners).is_none());
    }
}
