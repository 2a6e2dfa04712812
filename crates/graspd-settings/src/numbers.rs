//! The numbers in the value of a setting.

/// A value made of numbers: one, none, or several.
pub trait Numbers {
    /// Returns the first of them that `is_wrong` holds for.
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64>;
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Numbers for $number {
            fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
                Some(*self as f64).filter(|number| is_wrong(*number))
            }
        }
    )*};
}
numbers!(f64, u16, u32, u64, usize);

macro_rules! no_numbers {
    ($($other:ty),*) => {$(
        impl Numbers for $other {
            fn find(&self, _: &dyn Fn(f64) -> bool) -> Option<f64> {
                None
            }
        }
    )*};
}
no_numbers!((), bool, String);

impl<T: Numbers> Numbers for [T] {
    fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
        self.iter().find_map(|value| value.find(is_wrong))
    }
}

macro_rules! lists {
    ($([$($count:tt)*] $list:ty),*) => {$(
        impl<T: Numbers, $($count)*> Numbers for $list {
            fn find(&self, is_wrong: &dyn Fn(f64) -> bool) -> Option<f64> {
                self.as_slice().find(is_wrong)
            }
        }
    )*};
}
lists!([] Option<T>, [] Vec<T>, [const N: usize] [T; N]);
