//! What a repair did.

use graspd_settings::{FRACTION, NOT_NEGATIVE, Ranges, Validate, between, ranges};

/// How much a mesh had to change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RepairTier {
    /// It was closed, and is as it was.
    Untouched,
    /// Defects were mended where they were; the rest of the surface is as it was.
    Mended,
    /// The whole surface was made anew, as an isosurface.
    Resurfaced,
}

impl RepairTier {
    /// In one word, for files: `untouched`, `mended` or `resurfaced`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Untouched => "untouched",
            Self::Mended => "mended",
            Self::Resurfaced => "resurfaced",
        }
    }
}

/// A hole that was filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilledHole {
    /// Edges around it.
    pub edges: usize,
    /// Length of its boundary \[m\].
    pub length: f64,
    /// Greatest distance between two vertices of its boundary \[m\]; of over 1000 vertices, between every k-th.
    pub diameter: f64,
    /// Area of the patch over it \[m^2\].
    pub area: f64,
}

/// What a repair changed, and by how much the surface moved.
#[derive(Clone, Debug, PartialEq)]
pub struct RepairReport {
    /// How much had to change. If the mesh was resurfaced, the other counts tell what had been mended before that.
    pub tier: RepairTier,
    /// Holes that were filled, the longest first.
    pub holes: Vec<FilledHole>,
    /// Faces dropped because they named a vertex twice.
    pub degenerate_dropped: usize,
    /// Faces dropped because another one has the same vertices.
    pub copies_dropped: usize,
    /// Vertices that went because they were welded to others.
    pub vertices_welded: usize,
    /// Vertices added because manifolds that shared one were cut apart.
    pub vertices_split: usize,
    /// Faces turned over.
    pub faces_flipped: usize,
    /// Faces without area that were removed by flipping or shrinking a side.
    pub slivers_removed: usize,
    /// Connected parts dropped because they were small.
    pub small_components_dropped: usize,
    /// Connected parts dropped because they lay wholly inside others.
    pub inner_components_dropped: usize,
    /// Connected parts dropped because they enclosed nothing.
    pub flat_components_dropped: usize,
    /// Greatest distance from a point of the input to the result \[m\], over vertices and random points: a lower
    /// bound of the one-sided Hausdorff distance. Dropped parts count.
    pub input_to_result: f64,
    /// Likewise from the result to the input: how far patches bulge from what was there.
    pub result_to_input: f64,
    /// Distance between grid nodes if the mesh was resurfaced \[m\].
    pub spacing: Option<f64>,
    /// Part of the area of the resurfaced input that encloses nothing and was given a thickness.
    pub thickened: f64,
}

impl RepairReport {
    pub(super) fn of(tier: RepairTier) -> Self {
        Self {
            tier,
            holes: Vec::new(),
            degenerate_dropped: 0,
            copies_dropped: 0,
            vertices_welded: 0,
            vertices_split: 0,
            faces_flipped: 0,
            slivers_removed: 0,
            small_components_dropped: 0,
            inner_components_dropped: 0,
            flat_components_dropped: 0,
            input_to_result: 0.0,
            result_to_input: 0.0,
            spacing: None,
            thickened: 0.0,
        }
    }

    /// One line that tells what changed, lengths in millimetres.
    pub fn summary(&self) -> String {
        const MM_PER_M: f64 = 1000.0;
        if self.tier == RepairTier::Untouched {
            return "closed already; unchanged".into();
        }
        let longest = self
            .holes
            .iter()
            .map(|hole| hole.diameter)
            .fold(0.0, f64::max);
        let mut parts = Vec::new();
        let mut say = |count: usize, one: &str, many: &str| {
            if count > 0 {
                parts.push(format!("{count} {}", if count == 1 { one } else { many }));
            }
        };
        say(self.holes.len(), "hole filled", "holes filled");
        say(self.vertices_welded, "vertex welded", "vertices welded");
        say(
            self.vertices_split,
            "vertex split off",
            "vertices split off",
        );
        say(self.faces_flipped, "face turned over", "faces turned over");
        say(
            self.degenerate_dropped + self.copies_dropped,
            "superfluous face dropped",
            "superfluous faces dropped",
        );
        say(self.slivers_removed, "sliver removed", "slivers removed");
        say(
            self.small_components_dropped,
            "small part dropped",
            "small parts dropped",
        );
        say(
            self.inner_components_dropped,
            "inner part dropped",
            "inner parts dropped",
        );
        say(
            self.flat_components_dropped,
            "flat part dropped",
            "flat parts dropped",
        );
        let what = if parts.is_empty() {
            "mended".into()
        } else {
            parts.join(", ")
        };
        let what = match (self.tier, self.spacing) {
            (RepairTier::Resurfaced, Some(spacing)) => format!(
                "surface made anew at a spacing of {:.2} mm{}",
                MM_PER_M * spacing,
                if self.thickened > 0.0 {
                    format!(
                        ", {:.0} % of it a shell around open sheets",
                        100.0 * self.thickened
                    )
                } else {
                    String::new()
                }
            ),
            _ => what,
        };
        let hole = if longest > 0.0 && self.tier == RepairTier::Mended {
            format!(" (the largest {:.1} mm across)", MM_PER_M * longest)
        } else {
            String::new()
        };
        format!(
            "{what}{hole}; the new surface is up to {:.2} mm from the old, the old up to {:.2} mm from the new",
            MM_PER_M * self.result_to_input,
            MM_PER_M * self.input_to_result
        )
    }
}

/// How to repair a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepairSettings {
    /// Open edges this near to each other are welded, as a part of the diagonal of the mesh's box.
    pub weld_distance: f64,
    /// Connected parts with a smaller diagonal than this part of the whole mesh's are dropped, if all of them together
    /// have at most 5 % of its area.
    pub smallest_component: f64,
    /// Make the whole surface anew even if mending would do.
    pub resurface: bool,
    /// When a surface is made anew: grid cells along its longest side.
    pub resolution: usize,
    /// When a surface is made anew: thickness given to open sheets that enclose nothing \[m\]; at least 1.8 times the
    /// distance between grid nodes, which is what 0 stands for.
    pub sheet_thickness: f64,
}

impl Default for RepairSettings {
    fn default() -> Self {
        Self {
            weld_distance: 1e-5,
            smallest_component: 0.02,
            resurface: false,
            resolution: 128,
            sheet_thickness: 0.0,
        }
    }
}

impl Validate for RepairSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            weld_distance: FRACTION.less_than(1.0),
            smallest_component: FRACTION.less_than(1.0),
            resolution: between(8.0, 512.0),
            sheet_thickness: NOT_NEGATIVE.unit("m"),
        }
    }
}
