//! Types that a parameter may have.

use std::net::Ipv4Addr;

use super::{Domain, Setting, Value};

impl Setting for bool {
    fn domain(_bounds: Option<(f64, f64)>) -> Domain {
        Domain::Switch
    }

    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Bool(value) => Some(*value),
            _ => None,
        }
    }
}

macro_rules! whole_setting {
    ($($type:ty)*) => {$(
        impl Setting for $type {
            fn domain(bounds: Option<(f64, f64)>) -> Domain {
                let (low, high) = bounds.unwrap_or((0.0, i64::MAX as f64));
                Domain::Whole(low, high)
            }

            fn to_value(&self) -> Value {
                Value::Integer(*self as i64)
            }

            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    Value::Integer(value) => <$type>::try_from(*value).ok(),
                    _ => None,
                }
            }

            fn number(&self) -> Option<f64> {
                Some(*self as f64)
            }
        }
    )*};
}

whole_setting!(usize i64);

impl Setting for f64 {
    fn domain(bounds: Option<(f64, f64)>) -> Domain {
        let (low, high) = bounds.unwrap_or((f64::MIN, f64::MAX));
        Domain::Real(low, high)
    }

    fn to_value(&self) -> Value {
        Value::Real(*self)
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Real(value) => Some(*value),
            Value::Integer(value) => Some(*value as f64),
            _ => None,
        }
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

/// Addresses of hosts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Addresses(pub Vec<Ipv4Addr>);

impl Setting for Addresses {
    fn domain(_bounds: Option<(f64, f64)>) -> Domain {
        Domain::Addresses
    }

    fn to_value(&self) -> Value {
        let texts: Vec<String> = self.0.iter().map(Ipv4Addr::to_string).collect();
        Value::Text(texts.join(", "))
    }

    fn from_value(value: &Value) -> Option<Self> {
        let Value::Text(text) = value else {
            return None;
        };
        let parts = text
            .split(',')
            .map(str::trim)
            .filter(|part| !part.is_empty());
        let addresses: Option<_> = parts.map(|part| part.parse().ok()).collect();
        addresses.map(Self)
    }
}

/// A text, as the name of a file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Text(pub String);

impl Setting for Text {
    fn domain(_bounds: Option<(f64, f64)>) -> Domain {
        Domain::Text
    }

    fn to_value(&self) -> Value {
        Value::Text(self.0.clone())
    }

    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(text) => Some(Self(text.clone())),
            _ => None,
        }
    }
}
