//! Parameters of an integrator by name: tables of them are what scene files, the command line, the
//! documents and the fingerprints of pictures go by.

/// One parameter of the settings `S`.
#[derive(Debug, Clone, Copy)]
pub struct Parameter<S> {
    /// As scene files and the command line call it.
    pub name: &'static str,
    /// Unit; empty for words and switches, 1 for plain numbers.
    pub unit: &'static str,
    /// What it does, one line.
    pub doc: &'static str,
    /// What is another with another value.
    pub changes: Change,
    pub(in crate::integrator) field: Field<S>,
}

/// What a parameter changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// Only what is said about the picture.
    Nothing,
    /// The picture, but nothing that is stored for it.
    Picture,
    /// What is stored, and the picture.
    Records,
}

/// Where a parameter is, and what it can be.
#[derive(Debug, Clone, Copy)]
pub(in crate::integrator) enum Field<S> {
    Number {
        expected: &'static str,
        is_good: fn(f32) -> bool,
        get: fn(&S) -> f32,
        set: fn(&mut S, f32),
    },
    Count {
        least: u32,
        most: u32,
        get: fn(&S) -> u32,
        set: fn(&mut S, u32),
    },
    Switch {
        get: fn(&S) -> bool,
        set: fn(&mut S, bool),
    },
    Word {
        words: fn() -> Vec<&'static str>,
        get: fn(&S) -> &'static str,
        /// By place among the words.
        set: fn(&mut S, usize),
    },
}

/// Why a parameter cannot be set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParameterError {
    /// No such name.
    #[error("there is no parameter `{0}`")]
    Unknown(String),
    /// Not a value of this parameter.
    #[error("expected {expected}")]
    Value {
        /// What can be.
        expected: String,
        /// All values, where they are words.
        words: Vec<&'static str>,
    },
    /// What another program does and this one does not.
    #[error("{0}")]
    Refused(&'static str),
}

impl<S> Parameter<S> {
    /// The value in force, as text that [`Parameter::set`] reads.
    pub fn get(&self, settings: &S) -> String {
        match self.field {
            Field::Number { get, .. } => get(settings).to_string(),
            Field::Count { get, .. } => get(settings).to_string(),
            Field::Switch { get, .. } => get(settings).to_string(),
            Field::Word { get, .. } => get(settings).to_owned(),
        }
    }

    /// Sets the value from text.
    pub fn set(&self, settings: &mut S, value: &str) -> Result<(), ParameterError> {
        let value = value.trim();
        let wrong = || ParameterError::Value { expected: self.expected(), words: self.words() };
        match self.field {
            Field::Number { is_good, set, .. } => {
                let number = value.parse().ok().filter(|&number| is_good(number));
                set(settings, number.ok_or_else(wrong)?);
            }
            Field::Count { least, most, set, .. } => {
                let count = value.parse().ok().filter(|count| (least..=most).contains(count));
                set(settings, count.ok_or_else(wrong)?);
            }
            Field::Switch { set, .. } => match value {
                "true" | "yes" | "1" => set(settings, true),
                "false" | "no" | "0" => set(settings, false),
                _ => return Err(wrong()),
            },
            Field::Word { words, set, .. } => {
                let at = words().iter().position(|word| word.eq_ignore_ascii_case(value));
                set(settings, at.ok_or_else(wrong)?);
            }
        }
        Ok(())
    }

    /// What can be its value, in words.
    pub fn expected(&self) -> String {
        match self.field {
            Field::Number { expected, .. } => expected.to_owned(),
            Field::Count { least, most, .. } => format!("a whole number from {least} to {most}"),
            Field::Switch { .. } => "true or false".to_owned(),
            Field::Word { words, .. } => format!("one of {}", words().join(", ")),
        }
    }

    fn words(&self) -> Vec<&'static str> {
        match self.field {
            Field::Word { words, .. } => words(),
            _ => Vec::new(),
        }
    }
}
