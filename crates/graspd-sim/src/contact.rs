//! The contact law, once, over any scalar.

use graspd_ad::{Real, leaky_min};
use graspd_geom::Vec3;

use crate::params::{ContactParams, Twist, Wrench};

/// What the contact law needs to know of one contact, whatever the object's velocity is; object frame.
///
/// ```
/// use graspd_geom::Vec3;
/// use graspd_sim::{ContactParams, ContactState, Twist};
///
/// // 1 mm inside the top of a ball of 5 cm, which moves to the side at 2 cm/s.
/// let point = Vec3::new(0.0, 0.0, 0.049);
/// let contact = ContactState::new(point.norm() - 0.05, point, point, 0.1);
/// let twist = Twist { linear: Vec3::new(0.02, 0.0, 0.0), angular: Vec3::zero() };
/// let wrench = contact.wrench(&twist, &ContactParams::default());
/// // 1e6 N/m push the ball down; 0.8 times as much holds it back.
/// assert!((wrench.force - Vec3::new(-800.0, 0.0, -1000.0)).norm() < 1e-6);
/// assert!((wrench.torque - Vec3::new(0.0, -800.0 * 0.049, 0.0)).norm() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ContactState<T> {
    /// |min(d, 0)|, how far the contact is inside the (dilated) object \[m\]; its derivative leaks where d > 0.
    pub depth: T,
    /// Outward unit normal of the object at the contact; zero where the distance field has no gradient.
    pub normal: Vec3<T>,
    /// r_c = p_c - COM, from the object's centre of mass to the contact \[m\].
    pub lever: Vec3<T>,
}

impl<T: Real> ContactState<T> {
    /// From the signed distance d \[m\] to the (dilated) surface, the distance's gradient, of any length, and the
    /// lever r_c \[m\].
    ///
    /// The depth has a kink at d = 0: up to there its derivative is that of contact, -1 times that of d; where d > 0
    /// it is the fraction `leak` of that instead of 0. Where `gradient` is zero, so is the derivative of the normal.
    #[inline(always)]
    pub fn new(distance: T, gradient: Vec3<T>, lever: Vec3<T>, leak: f64) -> Self {
        Self {
            depth: -leaky_min(distance, leak),
            normal: gradient.normalize_or_zero(),
            lever,
        }
    }

    /// The wrench on the object that moves with `twist`; the hand stands still.
    ///
    /// With the depth |c|, the hand's velocity relative to the object u = -(v + w x r_c) and its tangential part
    /// u_t = u - (u.n) n:
    ///
    /// ```text
    /// f = -k_n |c| n + min(k_f |c| |u_t|, mu k_n |c|) u_t / |u_t|,    wrench = (r_c x f, f)
    /// ```
    ///
    /// At u_t = 0 the friction is 0 and so is its derivative (by the twist, the limit from sticking would be k_f |c|).
    /// At the corner between sticking and sliding, |u_t| = mu k_n / k_f, the derivative is that of sticking. The force
    /// is continuous in depth and twist, and in the normal but where that is zero.
    ///
    /// # Source
    /// Grasp'D (ECCV 2022), section 3.2 and supplementary A.5; the friction's stiffness scales with the depth.
    #[inline(always)]
    pub fn wrench(&self, twist: &Twist<T>, params: &ContactParams) -> Wrench<T> {
        let force = self.force_per_depth(twist, params) * self.depth;
        Wrench {
            torque: self.lever.cross(force),
            force,
        }
    }

    /// The derivative of [`ContactState::wrench`] by the depth, at this normal and lever: the wrench at depth 1, for
    /// it is proportional to the depth.
    ///
    /// Where the depth is 0 this is the only way in which the wrench depends on the contact's position.
    #[inline(always)]
    pub fn wrench_per_depth(&self, twist: &Twist<T>, params: &ContactParams) -> Wrench<T> {
        let force = self.force_per_depth(twist, params);
        Wrench {
            torque: self.lever.cross(force),
            force,
        }
    }

    /// f / |c| \[N/m\].
    #[inline(always)]
    fn force_per_depth(&self, twist: &Twist<T>, params: &ContactParams) -> Vec3<T> {
        let slip = -(twist.linear + twist.angular.cross(self.lever));
        let tangential = slip - self.normal * slip.dot(self.normal);
        let speed_squared = tangential.norm_squared();
        let slips = speed_squared.gt(T::zero());
        let speed = T::select(slips, speed_squared, T::one()).sqrt();
        // Friction per depth and speed: k_f sticking, mu k_n / |u_t| sliding. The depth stays outside the minimum: at
        // depth 0 both sides would tie, and which of them leaks its gradient would be an accident.
        let sticking = T::constant(params.friction_stiffness);
        let sliding = T::constant(params.friction_coefficient * params.normal_stiffness) / speed;
        let mut friction = sticking.min(sliding);
        if params.slides_at_zero_depth {
            friction = T::select(self.depth.gt(T::zero()), friction, sliding);
        }
        let friction = T::select(slips, friction, T::zero());
        let stiffness = T::constant(params.normal_stiffness);
        tangential * friction - self.normal * stiffness
    }
}
