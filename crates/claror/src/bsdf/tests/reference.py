"""Writes reference.txt: values of Mitsuba's BSDF plugins for the materials of reference.rs.

Run with a Python that has the package `mitsuba` (3.9): python reference.py > reference.txt
Each line: material, then wo and wi (world space, towards viewer and light), then eval() per
channel and pdf().  With an argument, that many random pairs of directions per material.
"""

import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)

# The point: a turned shading frame, skewed derivatives. The same numbers stand in reference.rs.
S, T, N = np.array([0.8, 0.0, -0.6]), np.array([0.36, 0.8, 0.48]), np.array([0.48, -0.6, 0.64])
DP_DU, DP_DV = 1.25 * S, 0.25 * S + 0.75 * T
NG = N

COLOR = {"type": "rgb", "value": [0.2, 0.5, 0.8]}
PALE = {"type": "rgb", "value": [0.9, 0.8, 0.7]}


def height():
    """Height 0.5·column - 0.25·row over 4 by 4 pixels."""
    y, x = np.mgrid[0:4, 0:4]
    data = (x * 0.5 - y * 0.25).astype(np.float32)[..., None]
    return {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(data)}


def normal(x, y, z):
    data = np.tile(np.array([x, y, z], np.float32), (2, 2, 1))
    return {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(data)}


def rough(**more):
    return {"type": "roughconductor", "material": "Au", **more}


def glass(**more):
    return {"type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, **more}


def coat(**more):
    return {"int_ior": 1.5, "ext_ior": 1.0, "diffuse_reflectance": COLOR, **more}


def disney(**more):
    return {"type": "principled", "base_color": COLOR, **more}


ANISO = {"alpha_u": 0.15, "alpha_v": 0.4}
PLAIN = {"flip_invalid_normals": False, "use_shadowing_function": False}
DIFFUSE = {"type": "diffuse", "reflectance": COLOR}
MATERIALS = {
    "diffuse": DIFFUSE,
    "gold-ggx": rough(distribution="ggx", alpha=0.25),
    "gold-beckmann": rough(distribution="beckmann", alpha=0.25, specular_reflectance=PALE),
    "gold-ggx-aniso": rough(distribution="ggx", **ANISO),
    "gold-beckmann-aniso-all": rough(distribution="beckmann", sample_visible=False, **ANISO),
    "glass-ggx": glass(distribution="ggx", alpha=0.3, specular_transmittance=PALE),
    "glass-beckmann-aniso": glass(distribution="beckmann", specular_reflectance=PALE, **ANISO),
    "glass-ggx-all": glass(distribution="ggx", alpha=0.5, sample_visible=False),
    "plastic": {"type": "plastic", **coat()},
    "plastic-nonlinear": {"type": "plastic", **coat(nonlinear=True, specular_reflectance=PALE)},
    "roughplastic-ggx": {"type": "roughplastic", **coat(distribution="ggx", alpha=0.2)},
    "roughplastic-beckmann": {
        "type": "roughplastic",
        **coat(distribution="beckmann", alpha=0.35, nonlinear=True, specular_reflectance=PALE),
    },
    "roughplastic-all": {
        "type": "roughplastic",
        **coat(distribution="beckmann", alpha=0.3, sample_visible=False),
    },
    "principled": disney(),
    "principled-cloth": disney(roughness=0.7, sheen=0.8, sheen_tint=0.6, flatness=0.5, spec_tint=0.4),
    "principled-varnish": disney(
        roughness=0.4, anisotropic=0.6, metallic=0.7, clearcoat=0.9, clearcoat_gloss=0.3
    ),
    "principled-glass": disney(
        roughness=0.35, spec_trans=0.8, eta=1.4, metallic=0.1, clearcoat=0.5, spec_tint=0.3
    ),
    "principled-rates": disney(
        spec_trans=0.3,
        specular=0.8,
        sheen=0.3,
        clearcoat=1.0,
        main_specular_sampling_rate=0.5,
        clearcoat_sampling_rate=2.0,
        diffuse_reflectance_sampling_rate=3.0,
    ),
    "twosided": {"type": "twosided", "n": rough(distribution="ggx", **ANISO)},
    "twosided-two": {"type": "twosided", "a": DIFFUSE, "b": rough(distribution="ggx", alpha=0.25)},
    "mask": {"type": "mask", "opacity": 0.4, "n": DIFFUSE},
    "blend": {
        "type": "blendbsdf",
        "weight": 0.3,
        "a": DIFFUSE,
        "b": rough(distribution="ggx", alpha=0.25),
    },
    "normalmap": {
        "type": "normalmap",
        "normalmap": normal(0.75, 0.25, 0.875),
        "n": rough(distribution="ggx", **ANISO),
    },
    "normalmap-plain": {
        "type": "normalmap",
        "normalmap": normal(0.75, 0.25, 0.875),
        "n": rough(distribution="ggx", **ANISO),
        **PLAIN,
    },
    "bumpmap-plain": {
        "type": "bumpmap",
        "t": height(),
        "scale": 0.375,
        "n": rough(distribution="ggx", **ANISO),
        **PLAIN,
    },
    "bumpmap": {
        "type": "bumpmap",
        "t": height(),
        "scale": 0.375,
        "n": rough(distribution="ggx", **ANISO),
    },
    "bumpmap-glass": {
        "type": "bumpmap",
        "t": height(),
        "scale": 0.375,
        "n": glass(distribution="ggx", alpha=0.3),
    },
    "twosided-bumpmap": {
        "type": "twosided",
        "n": {
            "type": "bumpmap",
            "t": height(),
            "scale": 0.375,
            "n": rough(distribution="ggx", **ANISO),
        },
    },
    "bumpmap-normalmap": {
        "type": "bumpmap",
        "t": height(),
        "scale": 0.125,
        "n": {"type": "normalmap", "normalmap": normal(0.75, 0.25, 0.875), "n": DIFFUSE},
    },
}


def interaction(wo):
    si = mi.SurfaceInteraction3f()
    si.p, si.n, si.uv = [0, 0, 0], list(NG), [0.4, 0.45]
    si.dp_du, si.dp_dv = list(DP_DU), list(DP_DV)
    frame = mi.Frame3f(list(N))
    frame.s, frame.t, frame.n = list(S), list(T), list(N)
    si.sh_frame = frame
    si.wi = local(wo)
    return si


def local(w):
    return [float(w @ S), float(w @ T), float(w @ N)]


def pairs(count):
    rng = np.random.default_rng(7)
    while count > 0:
        wo, wi = rng.normal(size=(2, 3))
        # Every other pair near the mirror direction, where narrow lobes are.
        if count % 2:
            wi = 2 * (wo @ N) * N - wo + 0.3 * wi
        yield wo / np.linalg.norm(wo), wi / np.linalg.norm(wi)
        count -= 1


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    context = mi.BSDFContext()
    for name, description in MATERIALS.items():
        bsdf = mi.load_dict(description)
        for wo, wi in pairs(count):
            # What both programs read are these decimals.
            wo, wi = (np.array([float(f"{x:.6f}") for x in w]) for w in (wo, wi))
            si = interaction(wo)
            value = bsdf.eval(context, si, local(wi))
            pdf = bsdf.pdf(context, si, local(wi))
            numbers = [*wo, *wi, *(float(c) for c in value), float(pdf)]
            print(name, *(f"{x:.7g}" for x in numbers))


main()
