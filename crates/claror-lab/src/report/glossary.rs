//! What each measure means.

use maud::{Markup, html};

/// The glossary.
pub(super) fn section() -> Markup {
    html! {
        section #glossary aria-labelledby="glossary-title" {
            h2 #glossary-title { "Measures" }
            p { "In tables, the large number is the median over the seeds, the small ones are the smallest and largest. " i { "x" } " is the picture, " i { "r" } " the reference, both linear RGB radiance; means go over pixels and channels." }
            dl.glossary {
                dt { "CPU time" } dd { "Processor seconds of the whole process, user and system. On a quiet machine with one thread it is the wall-clock time." }
                dt { "Wall time" } dd { "Seconds of rendering by the clock, as the program says." }
                dt { "Records" } dd { "Points at which the cache holds irradiance." }
                dt { "Memory" } dd { "Largest resident memory of the process, in MiB." }
                dt { "MSE" } dd { "Mean of (" i { "x" } " − " i { "r" } ")². Bright pixels rule it." }
                dt { "relMSE" } dd {
                    "Relative mean squared error, in which dark and bright pixels count alike, free of the reference's own noise. The reference is made twice, as independent halves " i { "a" } " and " i { "b" } " with mean " i { "r" } ":"
                    p.formula role="math" aria-label="relMSE is the mean of (x minus a) times (x minus b) over (r squared plus 0.01)" { "relMSE = mean of  ( " i { "x" } " − " i { "a" } " ) · ( " i { "x" } " − " i { "b" } " ) / ( " i { "r" } "² + 0.01 )" }
                    "The noise of " i { "a" } " and that of " i { "b" } " are independent and vanish from the product in the mean; (" i { "x" } " − " i { "r" } ")² would add them to every error. Near the noise of the reference the value is uncertain and can be below 0: such settings are in the tables and are left out of logarithmic charts."
                }
                dt { "MAPE" } dd { "Mean of |" i { "x" } " − " i { "r" } "| / (|" i { "r" } "| + 0.01)." }
                dt { "Bias" } dd { "Mean of the picture over mean of the reference, minus 1. Noise averages out of it; what is left is light that is missing (−) or too much (+)." }
                dt { "SSIM" } dd { "Mean structural similarity of the tone-mapped luminance: 1 is equal." }
                dt { "FLIP" } dd { "Mean visible difference to someone who flips between the two pictures (Andersson et al. 2020), 0.7 m from a screen 0.7 m wide: 0 is equal. The map shows it per pixel." }
                dt { "Slope" } dd { "Exponent of relMSE against CPU time, least squares in the logarithms. Independent samples alone give −1." }
                dt { "Time at equal error" } dd { "Interpolated between neighbouring settings in the logarithms of time and error; never extrapolated. Of a method whose settings all lie above or below an error only a bound is known." }
                dt { "Pareto front" } dd { "Settings that no other setting beats in both CPU time and relMSE." }
            }
        }
    }
}
