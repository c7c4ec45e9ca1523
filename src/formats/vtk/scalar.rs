//! Numbers as VTK stores them in bytes.

pub(super) use crate::formats::scalar::Scalar;
use planish_core::vec3::Vec3;

/// In which order the bytes of a number stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Big,
    Little,
}

impl Order {
    /// The whole number of up to 64 bits that these bytes are, as unsigned.
    pub(super) fn whole(self, bytes: &[u8]) -> u64 {
        // The highest byte first: each shifts those before it.
        match self {
            Self::Big => bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte)),
            Self::Little => bytes.iter().rfold(0, |number, byte| number << 8 | u64::from(*byte)),
        }
    }
}

/// Collects what `$each` makes of the numbers of a type, taken `$group` at a time.
macro_rules! collected {
    ($type:ty, $group:literal, $bytes:expr, $order:expr, $each:expr) => {{
        let groups = $bytes.as_chunks::<{ size_of::<$type>() }>().0.as_chunks::<$group>().0;
        match $order {
            Order::Big => groups.iter().map(|g| $each(g.map(<$type>::from_be_bytes))).collect(),
            Order::Little => groups.iter().map(|g| $each(g.map(<$type>::from_le_bytes))).collect(),
        }
    }};
}

/// The first number of a type that is none from 0 to 2^32 - 1, or all of them as such.
macro_rules! ids {
    ($type:ty, $bytes:expr, $order:expr) => {{
        let numbers = $bytes.as_chunks::<{ size_of::<$type>() }>().0;
        let value = |b: [u8; size_of::<$type>()]| match $order {
            Order::Big => <$type>::from_be_bytes(b),
            Order::Little => <$type>::from_le_bytes(b),
        };
        match numbers.iter().position(|b| u32::try_from(value(*b)).is_err()) {
            Some(entry) => Err(BadId { entry, value: value(numbers[entry]).to_string() }),
            None => Ok(collected!($type, 1, $bytes, $order, |[n]: [$type; 1]| n as u32)),
        }
    }};
}

/// A number that can be no id.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct BadId {
    /// Which one.
    pub entry: usize,
    /// The number.
    pub value: String,
}

impl Scalar {
    /// The type of this name in legacy files, in lower case. An id is stored there as an int.
    pub(super) fn legacy(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"signed_char" | b"vtktypeint8" => Self::I8,
            b"unsigned_char" | b"vtktypeuint8" => Self::U8,
            b"short" | b"vtktypeint16" => Self::I16,
            b"unsigned_short" | b"vtktypeuint16" => Self::U16,
            b"int" | b"vtkidtype" | b"vtktypeint32" => Self::I32,
            b"unsigned_int" | b"vtktypeuint32" => Self::U32,
            b"long" | b"vtktypeint64" => Self::I64,
            b"unsigned_long" | b"vtktypeuint64" => Self::U64,
            b"float" | b"vtktypefloat32" => Self::F32,
            b"double" | b"vtktypefloat64" => Self::F64,
            _ => return None,
        })
    }

    /// The type of this name in XML files.
    pub(super) fn xml(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub(super) fn bytes(self) -> u64 {
        self.size() as u64
    }

    /// Triples of numbers; bytes that make no whole triple are left out.
    pub(super) fn points(self, bytes: &[u8], order: Order) -> Vec<Vec3> {
        macro_rules! points {
            ($type:ty) => {
                collected!($type, 3, bytes, order, |p: [$type; 3]| p.map(|c| c as f64))
            };
        }
        match self {
            Self::I8 => points!(i8),
            Self::U8 => points!(u8),
            Self::I16 => points!(i16),
            Self::U16 => points!(u16),
            Self::I32 => points!(i32),
            Self::U32 => points!(u32),
            Self::I64 => points!(i64),
            Self::U64 => points!(u64),
            Self::F32 => points!(f32),
            Self::F64 => points!(f64),
        }
    }

    /// Whole numbers; bytes that make none are left out. Floating point numbers are no ids.
    pub(super) fn ids(self, bytes: &[u8], order: Order) -> Result<Vec<u32>, BadId> {
        match self {
            Self::I8 => ids!(i8, bytes, order),
            Self::U8 => ids!(u8, bytes, order),
            Self::I16 => ids!(i16, bytes, order),
            Self::U16 => ids!(u16, bytes, order),
            Self::I32 => ids!(i32, bytes, order),
            Self::U32 => ids!(u32, bytes, order),
            Self::I64 => ids!(i64, bytes, order),
            Self::U64 => ids!(u64, bytes, order),
            Self::F32 | Self::F64 => Err(BadId { entry: 0, value: "of floating point".to_owned() }),
        }
    }

    /// What `each` makes of numbers of a whole type, and of the whole parts of others; bytes that make none are left out.
    pub(super) fn whole<T>(self, bytes: &[u8], order: Order, mut each: impl FnMut(i128) -> T) -> Vec<T> {
        macro_rules! whole {
            ($type:ty) => {
                collected!($type, 1, bytes, order, |[n]: [$type; 1]| each(n as i128))
            };
        }
        match self {
            Self::I8 => whole!(i8),
            Self::U8 => whole!(u8),
            Self::I16 => whole!(i16),
            Self::U16 => whole!(u16),
            Self::I32 => whole!(i32),
            Self::U32 => whole!(u32),
            Self::I64 => whole!(i64),
            Self::U64 => whole!(u64),
            Self::F32 => whole!(f32),
            Self::F64 => whole!(f64),
        }
    }

    /// Numbers of whatever type; bytes that make none are left out.
    pub(super) fn numbers(self, bytes: &[u8], order: Order) -> Vec<f64> {
        macro_rules! numbers {
            ($type:ty) => {
                collected!($type, 1, bytes, order, |[n]: [$type; 1]| n as f64)
            };
        }
        match self {
            Self::I8 => numbers!(i8),
            Self::U8 => numbers!(u8),
            Self::I16 => numbers!(i16),
            Self::U16 => numbers!(u16),
            Self::I32 => numbers!(i32),
            Self::U32 => numbers!(u32),
            Self::I64 => numbers!(i64),
            Self::U64 => numbers!(u64),
            Self::F32 => numbers!(f32),
            Self::F64 => numbers!(f64),
        }
    }

    /// Floating-point numbers, of which there are none where the type is another.
    pub(super) fn floats(self, bytes: &[u8], order: Order) -> Vec<f64> {
        match self {
            Self::F32 => collected!(f32, 1, bytes, order, |[n]: [f32; 1]| f64::from(n)),
            Self::F64 => collected!(f64, 1, bytes, order, |[n]: [f64; 1]| n),
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(&str, Scalar); 10] = [
        ("Int8", Scalar::I8),
        ("UInt8", Scalar::U8),
        ("Int16", Scalar::I16),
        ("UInt16", Scalar::U16),
        ("Int32", Scalar::I32),
        ("UInt32", Scalar::U32),
        ("Int64", Scalar::I64),
        ("UInt64", Scalar::U64),
        ("Float32", Scalar::F32),
        ("Float64", Scalar::F64),
    ];

    #[test]
    fn whole_numbers_of_every_size_and_order_are_read() {
        for (name, scalar) in ALL {
            assert_eq!(Scalar::xml(name), Some(scalar));
            let size = scalar.size();
            if [Scalar::F32, Scalar::F64].contains(&scalar) {
                assert!(scalar.ids(&[0; 8], Order::Big).is_err());
                continue;
            }
            let little = [&[7][..], &vec![0; size - 1]].concat();
            let big: Vec<u8> = little.iter().rev().copied().collect();
            assert_eq!(scalar.ids(&little, Order::Little), Ok(vec![7]), "{name}");
            assert_eq!(scalar.ids(&big.repeat(2), Order::Big), Ok(vec![7, 7]), "{name}");
            assert_eq!(scalar.points(&big.repeat(3), Order::Big), [[7.0; 3]], "{name}");
        }
        assert_eq!(Scalar::F32.points(&1.5_f32.to_be_bytes().repeat(3), Order::Big), [[1.5; 3]]);
        assert_eq!(Scalar::F64.points(&(-1.5_f64).to_le_bytes().repeat(3), Order::Little), [[-1.5; 3]]);
    }

    #[test]
    fn negative_and_large_numbers_are_no_ids() {
        let bytes = [1_i64, -2].map(i64::to_le_bytes).concat();
        assert_eq!(Scalar::I64.ids(&bytes, Order::Little), Err(BadId { entry: 1, value: "-2".to_owned() }));
        let large = (1_u64 << 32).to_le_bytes();
        assert_eq!(Scalar::U64.ids(&large, Order::Little).expect_err("large").value, "4294967296");
        assert_eq!(Scalar::U32.ids(&[255; 4], Order::Little), Ok(vec![u32::MAX]));
    }
}
