//! What can be wrong with a hand.

use std::path::PathBuf;

use graspd_settings::OutOfRange;

/// Why a hand could not be built or loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HandError {
    /// A fault of what a file says; the message of `error` follows the file's name.
    #[error("{}: {error}", file.display())]
    InFile {
        /// The file.
        file: PathBuf,
        /// What is wrong in it.
        error: Box<HandError>,
    },
    /// A file could not be read.
    #[error("{}: cannot be read ({error}); check the path and its permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// What the operating system said.
        error: std::io::Error,
    },
    /// No built-in hand and no file has the name that was given.
    #[error(
        "{name}: neither a built-in hand ({built_in}) nor an existing file; give one of those names or the path \
            of a .urdf, .pkl or .npz file"
    )]
    UnknownHand {
        /// The name.
        name: String,
        /// Names of the built-in hands.
        built_in: String,
    },
    /// The file's kind is not one that hands are read from.
    #[error("{}: not a kind of file that describes a hand; give a .urdf file, or a MANO model (.pkl or .npz)",
        file.display())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// A file without content.
    #[error("the file is empty; export or download it again")]
    Empty,
    /// Not well-formed XML, or not URDF.
    #[error("not a URDF file ({0}); check that it is the robot's .urdf and complete")]
    NotUrdf(String),
    /// A xacro macro file where a URDF was expected.
    #[error(
        "uses xacro macros; expand them first, for example with `xacro {} > hand.urdf`", file.display()
    )]
    Xacro {
        /// The file.
        file: PathBuf,
    },
    /// A description without links.
    #[error("describes no links; check that it is the hand's own .urdf")]
    NoLinks,
    /// A description in which nothing can move.
    #[error(
        "has no joint that can move; a hand needs at least one revolute, continuous or prismatic joint"
    )]
    NoMovableJoints,
    /// Two links or two joints of one name.
    #[error("has two {kind}s named `{name}`; rename one of them")]
    DuplicateName {
        /// "link" or "joint".
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that does not exist.
    #[error(
        "joint `{joint}` names link `{link}`, which does not exist; add the link or correct the name"
    )]
    MissingLink {
        /// The joint.
        joint: String,
        /// The link that it names.
        link: String,
    },
    /// A link is the child of two joints.
    #[error(
        "link `{link}` is the child of joints `{first}` and `{second}`; a hand is a tree: remove one of them"
    )]
    TwoParents {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other.
        second: String,
    },
    /// Links that hang on each other in a ring.
    #[error("the joints form a cycle through link `{link}`; a hand is a tree: cut the cycle")]
    Cycle {
        /// A link of the ring.
        link: String,
    },
    /// More than one link without a parent.
    #[error("has several root links ({}); join them by fixed joints or remove those that do not belong to the \
        hand", roots.join(", "))]
    SeveralRoots {
        /// The links without a parent.
        roots: Vec<String>,
    },
    /// A joint of a kind that a hand's joint cannot be.
    #[error(
        "joint `{joint}` is {kind}, which is not supported; use revolute, continuous, prismatic or fixed joints"
    )]
    UnsupportedJoint {
        /// The joint.
        joint: String,
        /// Its kind.
        kind: String,
    },
    /// A movable joint whose axis has no direction.
    #[error("joint `{joint}` has an axis of length zero; give it a direction, such as `0 0 1`")]
    ZeroAxis {
        /// The joint.
        joint: String,
    },
    /// A number that is not finite.
    #[error("{what} is not a finite number; correct it")]
    NotFinite {
        /// Where it stands.
        what: String,
    },
    /// A lower limit above the upper one.
    #[error(
        "joint `{joint}` has lower limit {lower} above its upper limit {upper}; swap or correct them"
    )]
    ReversedLimits {
        /// The joint.
        joint: String,
        /// Its lower limit.
        lower: f64,
        /// Its upper limit.
        upper: f64,
    },
    /// A mimic joint that follows nothing that moves by itself.
    #[error("joint `{joint}` mimics `{followed}`, which {fault}; let it follow a movable joint")]
    BadMimic {
        /// The joint that follows.
        joint: String,
        /// The joint that it follows.
        followed: String,
        /// What is wrong with that.
        fault: &'static str,
    },
    /// A size that no body can have.
    #[error("link `{link}` has a {shape} of size {size}; sizes must be finite and positive")]
    BadSize {
        /// The link.
        link: String,
        /// "box", "cylinder", "sphere", "capsule" or "mesh".
        shape: &'static str,
        /// The size as it stands.
        size: String,
    },
    /// A mesh file that was not found.
    #[error("link `{link}` needs mesh `{mesh}`, which was not found (looked in {}); put it there, or name the \
        folder that it or its package is in with --package-path (`search_paths` in programs, `package_paths` in \
        the .toml beside the URDF)", looked_in.join(", "))]
    MissingMesh {
        /// The link.
        link: String,
        /// The mesh as the file names it.
        mesh: String,
        /// Where it was looked for.
        looked_in: Vec<String>,
    },
    /// A mesh file that was found but cannot be read.
    #[error("link `{link}` has a mesh that cannot be read: {error}")]
    BadMesh {
        /// The link.
        link: String,
        /// What is wrong with the mesh file, by name.
        error: graspd_geom::GeometryError,
    },
    /// A part that is not a closed, outward oriented surface.
    #[error("a part of `{body}` is not a closed surface with outward faces ({error}); repair it")]
    OpenPart {
        /// The body.
        body: String,
        /// What is wrong with its mesh.
        error: graspd_geom::GeometryError,
    },
    /// A hand without any surface.
    #[error(
        "has no collision or visual geometry, so that nothing could touch; add some to its links"
    )]
    NoGeometry,
    /// A pickle that breaks off or that no pickler would write.
    #[error("is no pickle that a MANO file could be, or is damaged ({0}); download it again")]
    BadPickle(String),
    /// A class or function that the files of MANO do not name.
    #[error(
        "names `{name}`, which MANO's files do not: refused, and nothing was run; use the file as downloaded, \
            or save its arrays as .npz"
    )]
    RefusedGlobal {
        /// Module and name.
        name: String,
    },
    /// A file that is no archive of arrays.
    #[error("is no .npz archive, or is damaged ({0}); write it with numpy.savez")]
    BadArchive(String),
    /// A file too large to be a hand.
    #[error("is larger than {} MiB, more than any hand model has; is it the right file?", limit >> 20)]
    TooLarge {
        /// The largest size that is read \[bytes\].
        limit: u64,
    },
    /// A model without an array that it needs.
    #[error("has no array `{array}`; it has {found}; MANO's layout needs it")]
    MissingArray {
        /// The array.
        array: &'static str,
        /// The arrays that are there.
        found: String,
    },
    /// An array of a skinned hand that cannot be right.
    #[error("array `{array}` {fault}")]
    BadModel {
        /// The array, as MANO's files name it.
        array: &'static str,
        /// What is wrong with it, and what is expected.
        fault: String,
    },
    /// Something wrong in the settings beside a URDF.
    #[error("{}: {fault}", file.display())]
    BadSettings {
        /// The settings file.
        file: PathBuf,
        /// What is wrong and what to do.
        fault: String,
    },
    /// An option out of its range.
    #[error(transparent)]
    Option(#[from] OutOfRange),
    /// An option that a hand does not have.
    #[error("option `{option}` is {value}; {remedy}")]
    BadOption {
        /// The option's name.
        option: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        remedy: &'static str,
    },
}
