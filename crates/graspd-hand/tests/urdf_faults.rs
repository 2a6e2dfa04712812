//! What is wrong with a URDF file, said in one line.

mod toy;

use graspd_hand::HandError;
use proptest::prelude::*;
use toy::{BOX, LIMIT, joint, load_text, robot};

/// The fault of a file, and what its message must mention besides the file.
fn check_fault(text: &str, is_expected: impl Fn(&HandError) -> bool, mentions: &[&str]) {
    let error = load_text(text).expect_err(text);
    let message = error.to_string();
    let HandError::InFile { error, .. } = &error else {
        panic!("{message} does not name the file");
    };
    assert!(is_expected(error), "{message}");
    assert!(
        !message.contains('\n') && message.contains("hand.urdf"),
        "{message}"
    );
    for word in mentions {
        assert!(message.contains(word), "{word} is not in: {message}");
    }
}

macro_rules! fault {
    ($text:expr, $pattern:pat, $($word:expr),*) => {
        check_fault(&$text, |error| matches!(error, $pattern), &[$($word),*])
    };
}

#[test]
fn each_fault_has_its_message() {
    let bend = |links, rest: &str| joint("bend", "revolute", links, &format!("{rest}{LIMIT}"));
    let ab = |rest: &str| robot("ab", &bend(["a", "b"], rest));
    fault!("", HandError::Empty, "empty");
    fault!(" \n", HandError::Empty, "empty");
    fault!("# a mesh", HandError::NotUrdf(_), "URDF");
    fault!("<robot><link></robot>", HandError::NotUrdf(_), "URDF");
    fault!("<robot><link/></robot>", HandError::NotUrdf(_), "name");
    fault!(ab("")[..150], HandError::NotUrdf(_), "cut off");
    fault!(
        "<robot><xacro:macro/></robot>",
        HandError::Xacro { .. },
        "xacro",
        "expand"
    );
    fault!("<robot/>", HandError::NoLinks, "links");
    fault!(robot("a", ""), HandError::NoMovableJoints, "joint");
    fault!(
        robot("ab", &joint("weld", "fixed", ["a", "b"], "")),
        HandError::NoMovableJoints,
        "joint"
    );
    fault!(
        robot("aab", &bend(["a", "b"], "")),
        HandError::DuplicateName { .. },
        "`a`"
    );
    fault!(
        robot("a", &bend(["a", "b"], "")),
        HandError::MissingLink { .. },
        "`bend`",
        "`b`"
    );
    fault!(
        robot("abc", &bend(["a", "b"], "")),
        HandError::SeveralRoots { .. },
        "a, c"
    );
    let ring = [bend(["a", "b"], ""), joint("back", "fixed", ["b", "a"], "")].concat();
    fault!(robot("ab", &ring), HandError::Cycle { .. }, "cycle");
    fault!(robot("abc", &ring), HandError::Cycle { .. }, "cycle");
    fault!(
        robot("a", &bend(["a", "a"], "")),
        HandError::Cycle { .. },
        "cycle"
    );
    let two = [bend(["a", "c"], ""), joint("weld", "fixed", ["b", "c"], "")].concat();
    fault!(
        robot("abc", &two),
        HandError::TwoParents { .. },
        "`c`",
        "`bend`",
        "`weld`"
    );
    fault!(
        ab(r#"<axis xyz="0 0 0"/>"#),
        HandError::ZeroAxis { .. },
        "`bend`"
    );
    fault!(
        ab(r#"<axis xyz="0 nan 0"/>"#),
        HandError::NotFinite { .. },
        "axis",
        "`bend`"
    );
    fault!(
        ab(r#"<origin xyz="0 inf 0"/>"#),
        HandError::NotFinite { .. },
        "origin"
    );
    let reversed = joint(
        "bend",
        "revolute",
        ["a", "b"],
        r#"<limit lower="1" upper="-1"/>"#,
    );
    fault!(
        robot("ab", &reversed),
        HandError::ReversedLimits { .. },
        "`bend`",
        "lower"
    );
    let planar = joint("p", "planar", ["a", "b"], "");
    fault!(
        robot("ab", &planar),
        HandError::UnsupportedJoint { .. },
        "planar"
    );
    fault!(
        ab(r#"<mimic joint="c"/>"#),
        HandError::NoMovableJoints,
        "joint"
    );
    let follow = |followed: &str| {
        let mimic = format!(r#"{LIMIT}<mimic joint="{followed}"/>"#);
        [
            bend(["a", "b"], ""),
            joint("follow", "revolute", ["b", "c"], &mimic),
            joint("weld", "fixed", ["c", "d"], ""),
        ]
        .concat()
    };
    for followed in ["nobody", "weld", "follow"] {
        fault!(
            robot("abcd", &follow(followed)),
            HandError::BadMimic { .. },
            "`follow`"
        );
    }
    let circle = [
        bend(["a", "b"], ""),
        joint(
            "one",
            "revolute",
            ["b", "c"],
            &format!(r#"{LIMIT}<mimic joint="two"/>"#),
        ),
        joint(
            "two",
            "revolute",
            ["c", "d"],
            &format!(r#"{LIMIT}<mimic joint="one"/>"#),
        ),
    ];
    fault!(
        robot("abcd", &circle.concat()),
        HandError::BadMimic { .. },
        "`one` mimics `two`",
        "in a circle"
    );
    fault!(
        ab(r#"<axis xyz="0 0 0"/>"#).replace("bend", "be&#10;nd"),
        HandError::ZeroAxis { .. },
        "`be?nd`"
    );
    let bad_size = ab("").replacen("0.02 0.02 0.02", "0.02 0 0.02", 1);
    fault!(bad_size, HandError::BadSize { .. }, "`a`", "box");
    let mesh = |file: &str| {
        ab("").replacen(
            r#"<box size="0.02 0.02 0.02"/>"#,
            &format!(r#"<mesh filename="{file}"/>"#),
            1,
        )
    };
    fault!(
        mesh("package://x/none.stl"),
        HandError::MissingMesh { .. },
        "none.stl",
        "`a`"
    );
    for (name, content) in [
        ("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
        ("none.stl", "solid nothing\nendsolid nothing\n"),
        ("none.off", "OFF\n1 0 0\n0 0 0\n"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        std::fs::write(&file, content).unwrap();
        let at = file.to_str().unwrap();
        fault!(mesh(at), HandError::BadMesh { .. }, "`a`", name, "no faces");
    }
    fault!(mesh("hand.urdf"), HandError::BadMesh { .. }, "`a`", ".urdf");
    fault!(ab("").replace(BOX, ""), HandError::NoGeometry, "geometry");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Damaged files give a hand or an error that names the file, whatever was damaged.
    #[test]
    fn damaged_files_are_errors(at in 0.0..1.0, length in 0_usize..40, junk in ".{0,12}") {
        let joints = joint("bend", "revolute", ["a", "b"], &format!(r#"<origin xyz="0 0 1"/>{LIMIT}"#));
        let mut text: Vec<char> = robot("ab", &joints).chars().collect();
        let start = (at * text.len() as f64) as usize;
        let end = (start + length).min(text.len());
        text.splice(start..end, junk.chars());
        let text: String = text.into_iter().collect();
        if let Err(error) = load_text(&text) {
            let message = error.to_string();
            prop_assert!(message.contains("hand.urdf") && !message.contains('\n'), "{message}");
        }
    }
}
