//! `$name` in attribute values: from `<default>` and from the command line.

use std::collections::BTreeMap;

use super::nearest::hint;

/// One name with its value.
#[derive(Debug, Clone)]
struct Parameter {
    value: String,
    used: bool,
    from_command_line: bool,
}

/// All names that can be substituted.
#[derive(Debug, Clone, Default)]
pub(super) struct Parameters {
    entries: BTreeMap<String, Parameter>,
}

/// Why a substitution failed: message and hint.
pub(super) type Failure = (String, Option<String>);

/// Longest value after substitution, bytes: defaults made of defaults can double each time.
const MAX_VALUE: usize = 1 << 20;

impl Parameters {
    /// With the definitions of the command line; a later one of the same name wins.
    pub(super) fn new(defines: &[(String, String)]) -> Self {
        let entry = |(name, value): &(String, String)| {
            let value = value.clone();
            (name.clone(), Parameter { value, used: false, from_command_line: true })
        };
        Self { entries: defines.iter().map(entry).collect() }
    }

    /// `<default>`: sets the value unless there is one.
    pub(super) fn set_default(&mut self, name: &str, value: &str) {
        let parameter =
            Parameter { value: value.to_owned(), used: false, from_command_line: false };
        self.entries.entry(name.to_owned()).or_insert(parameter);
    }

    /// `text` with every `$name` replaced; `\$` is a plain `$`. As in Mitsuba the longest
    /// known name wins, so that `$spp2` is `$spp` followed by 2 when only `spp` is known.
    pub(super) fn substitute(&mut self, text: &str) -> Result<String, Failure> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(i) = rest.find('$') {
            let before = &rest[..i];
            rest = &rest[i + 1..];
            if let Some(escaped) = before.strip_suffix('\\') {
                out.push_str(escaped);
                out.push('$');
                continue;
            }
            out.push_str(before);
            let is_name = |c: char| c.is_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_name(c)).unwrap_or(rest.len());
            let name = &rest[..length];
            let Some((found, parameter)) = self.longest_prefix(name) else {
                let known = self.entries.keys().map(String::as_str);
                let message = format!("undefined parameter ${}", super::values::short(name));
                return Err((message, hint(name, known)));
            };
            parameter.used = true;
            out.push_str(&parameter.value);
            rest = &rest[found..];
            if out.len() > MAX_VALUE {
                return Err((format!("the value is longer than {MAX_VALUE} bytes"), None));
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    fn longest_prefix(&mut self, name: &str) -> Option<(usize, &mut Parameter)> {
        let ends = name.char_indices().map(|(i, c)| i + c.len_utf8());
        let found = ends.rev().find(|end| self.entries.contains_key(&name[..*end]))?;
        Some((found, self.entries.get_mut(&name[..found])?))
    }

    /// Definitions of the command line that no attribute asked for, with the nearest name that
    /// the scene knows.
    pub(super) fn unused_defines(&self) -> Vec<(String, Option<String>)> {
        let known = self.entries.iter().filter(|(_, p)| !p.from_command_line || p.used);
        let known: Vec<&str> = known.map(|(n, _)| n.as_str()).collect();
        let unused = self.entries.iter().filter(|(_, p)| p.from_command_line && !p.used);
        unused.map(|(n, _)| (n.clone(), hint(n, known.iter().copied()))).collect()
    }

    /// All names with their values.
    pub(super) fn resolved(self) -> Vec<(String, String)> {
        self.entries.into_iter().map(|(n, p)| (n, p.value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> Parameters {
        let mut p = Parameters::new(&[("spp".into(), "64".into()), ("unusd".into(), "1".into())]);
        p.set_default("spp", "16");
        p.set_default("spp_low", "4");
        p.set_default("unused", "2");
        p
    }

    #[test]
    fn names_are_replaced() {
        let mut p = parameters();
        assert_eq!(p.substitute("a $spp b$spp_low-$spp2 \\$spp"), Ok("a 64 b4-642 $spp".into()));
        assert_eq!(p.substitute("plain"), Ok("plain".into()));
    }

    #[test]
    fn unknown_names_are_errors() {
        let (message, hint) = parameters().substitute("$sp").unwrap_err();
        assert_eq!(message, "undefined parameter $sp");
        assert_eq!(hint.as_deref(), Some("did you mean \"spp\"?"));
        assert!(parameters().substitute("100$").is_err());
    }

    #[test]
    fn unused_definitions_are_found() {
        let mut p = parameters();
        p.substitute("$spp").unwrap();
        let unused = p.unused_defines();
        assert_eq!(unused.len(), 1);
        assert_eq!(unused[0].0, "unusd");
        assert_eq!(unused[0].1.as_deref(), Some("did you mean \"unused\"?"));
    }

    #[test]
    fn doubling_defaults_are_bounded() {
        let mut p = Parameters::default();
        p.set_default("a0", "0123456789");
        let mut failed = false;
        for i in 0..60 {
            match p.substitute(&format!("$a{i}-$a{i}-")) {
                Ok(value) => p.set_default(&format!("a{}", i + 1), &value),
                Err(_) => failed = true,
            }
        }
        assert!(failed);
    }
}
