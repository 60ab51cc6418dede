//! The sun and the sky.

use super::Builder;
use crate::scene::properties::Properties;

impl<'a> Builder<'a> {
    /// `sunsky`, `sky` and `sun`.
    pub(super) fn sky(&mut self, properties: &Properties<'a>) {
        self.unsupported(properties, &[], "it is left out");
    }
}
