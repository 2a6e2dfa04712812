//! What a skinned hand is made from: the arrays of MANO's layout.

use crate::{HandError, Limit};

/// Joints of a skinned hand, in MANO's order: wrist, index1-3, middle1-3, pinky1-3, ring1-3, thumb1-3.
pub const SKINNED_JOINTS: usize = 16;
/// Numbers in the pose of all joints but the wrist: one rotation vector each.
pub const POSE_VALUES: usize = 3 * (SKINNED_JOINTS - 1);
/// Numbers in the pose feature: the entries of R - I of all joints but the wrist.
pub const POSE_FEATURES: usize = 9 * (SKINNED_JOINTS - 1);
/// Names of the joints, wrist first.
pub(super) const SKINNED_JOINT_NAMES: [&str; SKINNED_JOINTS] = [
    "wrist", "index1", "index2", "index3", "middle1", "middle2", "middle3", "pinky1", "pinky2",
    "pinky3", "ring1", "ring2", "ring3", "thumb1", "thumb2", "thumb3",
];
/// Parents of the joints: each finger's first joint hangs on the wrist.
pub const SKINNED_JOINT_PARENTS: [Option<usize>; SKINNED_JOINTS] = {
    let mut parents = [None; SKINNED_JOINTS];
    let mut joint = 1;
    while joint < SKINNED_JOINTS {
        parents[joint] = Some(if joint % 3 == 1 { 0 } else { joint - 1 });
        joint += 1;
    }
    parents
};

/// Where the joints of a shaped hand are.
#[derive(Clone, Debug, PartialEq)]
pub enum JointPlacement {
    /// J = regressor . shaped vertices: for each joint the vertices that count and their factors, `[16]`.
    Regressed(Vec<Vec<(u32, f64)>>),
    /// J = template + shape_directions . shape.
    Given {
        /// Joints of the unshaped hand \[m\], `[16, 3]`.
        template: Vec<[f64; 3]>,
        /// Movement of the joints by each shape parameter \[m\], `[16, 3, s]` row by row.
        shape_directions: Vec<f64>,
    },
}

/// A skinned hand as its file describes it, in MANO's layout (Romero, Tzionas, Black: Embodied Hands, 2017).
///
/// Arrays of more than two dimensions are stored row by row, the last index running fastest. `v` vertices, `s` shape
/// parameters, `k` pose components.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinnedModel {
    /// Its name, as records give it.
    pub name: String,
    /// Vertices of the mean shape with straight pose \[m\], `[v]`.
    pub template: Vec<[f64; 3]>,
    /// Triangles, counter-clockwise seen from outside. The surface may be open, as at MANO's wrist.
    pub faces: Vec<[u32; 3]>,
    /// Parent of each joint, `[16]`; the wrist has none.
    pub parents: Vec<Option<usize>>,
    /// How much each vertex follows each joint, `[v]`; rows sum to 1.
    pub weights: Vec<[f64; SKINNED_JOINTS]>,
    /// Where the joints are.
    pub joints: JointPlacement,
    /// Movement of the vertices by each shape parameter \[m\], `[v, 3, s]`; empty for a hand of one shape.
    pub shape_directions: Vec<f64>,
    /// Movement of the vertices by each entry of the pose feature \[m\], `[v, 3, 135]`: the entries of R - I of joints
    /// 1 to 15, row by row.
    pub pose_directions: Option<Vec<f64>>,
    /// Basis of the pose space: pose = mean + coefficients . components, `[k]` rows of 45 rotation-vector entries
    /// \[rad\].
    pub pose_components: Vec<[f64; POSE_VALUES]>,
    /// Mean of the pose space \[rad\], `[45]`.
    pub pose_mean: [f64; POSE_VALUES],
    /// Plausible range of each coefficient, counted from `pose_mean`, `[k]`; `None` where unknown.
    pub coefficient_limits: Option<Vec<Limit>>,
    /// Coefficients of the fully open hand, counted from `pose_mean`, `[k]`; `None` to have them found: the least
    /// curled pose within the limits.
    pub open_coefficients: Option<Vec<f64>>,
    /// Names of the coefficients, `[k]`; `None` for `pca_0`, `pca_1` ...
    pub component_names: Option<Vec<String>>,
}

impl SkinnedModel {
    /// Counts its shape parameters.
    pub fn shape_count(&self) -> usize {
        self.shape_directions.len() / (3 * self.template.len()).max(1)
    }

    /// Checks all shapes, indices and numbers.
    ///
    /// # Errors
    /// [`HandError::BadModel`] naming the first array that is wrong, under the name that it has in MANO's files, what
    /// is wrong with it and what it should be.
    pub fn validate(&self) -> Result<(), HandError> {
        let vertices = self.template.len();
        check((4..=MAX_VERTICES).contains(&vertices), "v_template", || {
            format!("has {vertices} vertices, where 4 to {MAX_VERTICES} are expected")
        })?;
        all_finite("v_template", self.template.iter().flatten())?;
        let size = self
            .template
            .iter()
            .flatten()
            .fold(0.0_f64, |size, x| size.max(x.abs()));
        check(size < MAX_COORDINATE, "v_template", || {
            format!("reaches {size} m from the origin; is it in millimetres? metres are expected")
        })?;
        check(!self.faces.is_empty(), "f", || "has no triangles".into())?;
        for (row, face) in self.faces.iter().enumerate() {
            let [a, b, c] = *face;
            check(face.iter().all(|&i| (i as usize) < vertices), "f", || {
                format!("row {row} names a vertex beyond the {vertices} of v_template")
            })?;
            check(a != b && b != c && c != a, "f", || {
                format!("row {row} names a vertex twice")
            })?;
        }
        self.validate_joints()?;
        length("weights", self.weights.len(), vertices, "vertices")?;
        all_finite("weights", self.weights.iter().flatten())?;
        for (row, weights) in self.weights.iter().enumerate() {
            let sum: f64 = weights.iter().sum();
            check((sum - 1.0).abs() < WEIGHT_SUM_TOLERANCE, "weights", || {
                format!("row {row} sums to {sum} instead of 1")
            })?;
        }
        self.validate_shape_directions()?;
        if let Some(directions) = &self.pose_directions {
            length(
                "posedirs",
                directions.len(),
                vertices * 3 * POSE_FEATURES,
                "numbers",
            )?;
            all_finite("posedirs", directions)?;
        }
        self.validate_pose_space()
    }

    fn validate_joints(&self) -> Result<(), HandError> {
        length(
            "kintree_table",
            self.parents.len(),
            SKINNED_JOINTS,
            "joints",
        )?;
        check(self.parents[0].is_none(), "kintree_table", || {
            "gives the wrist, joint 0, a parent".into()
        })?;
        for (joint, parent) in self.parents.iter().enumerate().skip(1) {
            // Parents that come first leave no room for a cycle.
            check(
                parent.is_some_and(|parent| parent < joint),
                "kintree_table",
                || match parent {
                    Some(parent) => format!(
                        "gives joint {joint} the parent {parent}; parents must come before their children, so \
                            that there is no cycle"
                    ),
                    None => format!("gives joint {joint} no parent; only joint 0 has none"),
                },
            )?;
        }
        match &self.joints {
            JointPlacement::Regressed(rows) => {
                length("J_regressor", rows.len(), SKINNED_JOINTS, "rows")?;
                for (joint, row) in rows.iter().enumerate() {
                    check(!row.is_empty(), "J_regressor", || {
                        format!("row {joint} is empty")
                    })?;
                    all_finite("J_regressor", row.iter().map(|(_, factor)| factor))?;
                    check(
                        row.iter()
                            .all(|&(vertex, _)| (vertex as usize) < self.template.len()),
                        "J_regressor",
                        || format!("row {joint} names a vertex beyond those of v_template"),
                    )?;
                }
                Ok(())
            }
            JointPlacement::Given {
                template,
                shape_directions,
            } => {
                length("J", template.len(), SKINNED_JOINTS, "rows")?;
                all_finite("J", template.iter().flatten())?;
                let wanted = 3 * SKINNED_JOINTS * self.shape_count();
                length("J_shapedirs", shape_directions.len(), wanted, "numbers")?;
                all_finite("J_shapedirs", shape_directions)
            }
        }
    }

    fn validate_shape_directions(&self) -> Result<(), HandError> {
        let row = 3 * self.template.len();
        let len = self.shape_directions.len();
        check(
            len.is_multiple_of(row) && self.shape_count() <= MAX_SHAPES,
            "shapedirs",
            || {
                format!(
                    "has {len} numbers, where [{}, 3, 0 to {MAX_SHAPES}] are expected",
                    row / 3
                )
            },
        )?;
        all_finite("shapedirs", &self.shape_directions)
    }

    fn validate_pose_space(&self) -> Result<(), HandError> {
        let components = self.pose_components.len();
        check(
            (1..=POSE_VALUES).contains(&components),
            "hands_components",
            || format!("has {components} rows, where 1 to {POSE_VALUES} are expected"),
        )?;
        all_finite("hands_components", self.pose_components.iter().flatten())?;
        all_finite("hands_mean", &self.pose_mean)?;
        for (row, component) in self.pose_components.iter().enumerate() {
            check(
                component.iter().any(|&x| x != 0.0),
                "hands_components",
                || format!("row {row} is zero"),
            )?;
        }
        if let Some(limits) = &self.coefficient_limits {
            length("coefficient_limits", limits.len(), components, "ranges")?;
            for (row, limit) in limits.iter().enumerate() {
                // Written so that NaN fails.
                check(limit.lower <= limit.upper, "coefficient_limits", || {
                    format!("row {row} is empty: {} to {}", limit.lower, limit.upper)
                })?;
            }
        }
        if let Some(open) = &self.open_coefficients {
            length("open_coefficients", open.len(), components, "numbers")?;
            all_finite("open_coefficients", open)?;
        }
        if let Some(names) = &self.component_names {
            length("component_names", names.len(), components, "names")?;
        }
        Ok(())
    }
}

/// More vertices than any scanned hand has, so that a broken file is not tried.
const MAX_VERTICES: usize = 200_000;
/// More shape parameters than any published hand model has.
const MAX_SHAPES: usize = 100;
/// No hand reaches this far from its model's origin \[m\].
const MAX_COORDINATE: f64 = 2.0;
/// Skinning weights are often stored in single precision, or rounded.
const WEIGHT_SUM_TOLERANCE: f64 = 1e-3;

fn check(
    holds: bool,
    array: &'static str,
    fault: impl FnOnce() -> String,
) -> Result<(), HandError> {
    if holds {
        return Ok(());
    }
    Err(HandError::BadModel {
        array,
        fault: fault(),
    })
}

fn length(array: &'static str, len: usize, wanted: usize, what: &str) -> Result<(), HandError> {
    check(len == wanted, array, || {
        format!("has {len} {what}, where {wanted} are expected")
    })
}

fn all_finite<'a>(
    array: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), HandError> {
    let fault = values.into_iter().position(|x| !x.is_finite());
    check(fault.is_none(), array, || {
        format!(
            "has a number that is not finite, at place {}",
            fault.unwrap_or_default()
        )
    })
}
