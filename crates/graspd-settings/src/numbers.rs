//! The numbers in the value of a setting.

/// A value made of numbers: one, none, or several.
pub trait Numbers {
    /// The first of them that `is_wrong` holds for.
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64>;
}

impl Numbers for f64 {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        is_wrong(*self).then_some(*self)
    }
}

macro_rules! integers {
    ($($integer:ty),*) => {$(
        impl Numbers for $integer {
            fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
                (*self as f64).find(is_wrong)
            }
        }
    )*};
}
integers!(u16, u32, u64, usize);

macro_rules! without_numbers {
    ($($other:ty),*) => {$(
        impl Numbers for $other {
            fn find(&self, _: &dyn Fn(f64) -> bool) -> Option<f64> {
                None
            }
        }
    )*};
}
without_numbers!((), bool, String);

impl<T: Numbers> Numbers for Option<T> {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.as_slice().find(is_wrong)
    }
}

impl<T: Numbers> Numbers for [T] {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.iter().find_map(|value| value.find(is_wrong))
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.as_slice().find(is_wrong)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.as_slice().find(is_wrong)
    }
}
