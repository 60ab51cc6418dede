//! Parameters of `gridcache`.

use crate::integrator::parameter::{Change, Field, Parameter};

/// How the value at a point follows from those at the corners of its cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Interpolation {
    /// The mean of the four corners.
    Nearest4,
    /// Linear in both coordinates of the film.
    #[default]
    Bilinear,
    /// By Ward's weight with the distance itself in place of its ratio to a radius.
    Ward,
}

impl Interpolation {
    /// All of them, in the order in which each mends a fault of the one before.
    pub const ALL: [Self; 3] = [Self::Nearest4, Self::Bilinear, Self::Ward];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest4 => "nearest4",
            Self::Bilinear => "bilinear",
            Self::Ward => "ward",
        }
    }
}

/// What is computed at the points of the grid, and interpolated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// All that the surface reflects towards the camera: textures and edges smear.
    Color,
    /// Indirect irradiance.
    #[default]
    Irradiance,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Color, Self::Irradiance];

    /// As scene files and the command line call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Irradiance => "irradiance",
        }
    }
}

/// Parameters of `gridcache`: [`PARAMETERS`] explains them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridCacheSettings {
    /// Pixels from one point of the grid to the next.
    pub step: u32,
    /// Rays of a point.
    pub gather_samples: u32,
    /// Between the points.
    pub interpolation: Interpolation,
    /// At the points.
    pub quantity: Quantity,
    /// Whether the points are to be shown in a picture of their own.
    pub show_points: bool,
}

impl Default for GridCacheSettings {
    fn default() -> Self {
        Self {
            step: 20,
            gather_samples: 256,
            interpolation: Interpolation::Bilinear,
            quantity: Quantity::Irradiance,
            show_points: false,
        }
    }
}

/// One parameter of [`GridCacheSettings`].
pub type GridParameter = Parameter<GridCacheSettings>;

/// All parameters, in the order in which they are listed.
pub const PARAMETERS: &[GridParameter] = &[
    GridParameter {
        name: "step",
        unit: "pixels",
        doc: "from one point of the grid to the next",
        changes: Change::Records,
        field: Field::Count { least: 1, most: 65_536, get: |s| s.step, set: |s, v| s.step = v },
    },
    GridParameter {
        name: "gather_samples",
        unit: "rays",
        doc: "rays of a point over its hemisphere, rounded to a square; with `color` paths",
        changes: Change::Records,
        field: Field::Count {
            least: 16,
            most: 65_536,
            get: |s| s.gather_samples,
            set: |s, v| s.gather_samples = v,
        },
    },
    GridParameter {
        name: "interpolation",
        unit: "",
        doc: "between the four corners of a cell: their mean, linear in the picture, or by Ward's weight in space without a radius",
        changes: Change::Records,
        field: Field::Word {
            words: || Interpolation::ALL.map(Interpolation::name).to_vec(),
            get: |s| s.interpolation.name(),
            set: |s, i| s.interpolation = Interpolation::ALL[i],
        },
    },
    GridParameter {
        name: "quantity",
        unit: "",
        doc: "what is interpolated: all reflected light, or indirect irradiance alone",
        changes: Change::Records,
        field: Field::Word {
            words: || Quantity::ALL.map(Quantity::name).to_vec(),
            get: |s| s.quantity.name(),
            set: |s, i| s.quantity = Quantity::ALL[i],
        },
    },
    GridParameter {
        name: "show_points",
        unit: "",
        doc: "also write the picture with a dot for every point that sees a diffuse surface, as NAME.points.png",
        changes: Change::Nothing,
        field: Field::Switch { get: |s| s.show_points, set: |s, v| s.show_points = v },
    },
];

impl GridParameter {
    /// The parameter of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|parameter| parameter.name == name)
    }
}
