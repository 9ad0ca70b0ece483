"""Written by `python -m firstlight._stubs`."""

from typing import Any, Optional, Sequence, Union

from ._parts import Material, Texture

Color = Union[float, Sequence[float], str]
TABLE: Any


def diffuse(
    *,
    albedo: Union[Color, Texture],
) -> Material:
    """Lambert: f = albedo / π.

    - `albedo`: reflected share of light; f = albedo / π; must lie between 0 and 1: it is a share of light
    """


def plastic(
    *,
    diffuse: Union[Color, Texture],
    alpha: Union[float, Texture] = 0.0,
    ior: float = 1.5,
    specular: Union[float, Texture] = 1.0,
    nonlinear: bool = True,
    beckmann: bool = False,
) -> Material:
    """A diffuse base under a smooth or rough dielectric: the `plastic` and `roughplastic` of Mitsuba 3, and the `coateddiffuse` of pbrt-v4 in closed form; see `shading/plastic`.

    - `diffuse`: albedo of the base; must lie between 0 and 1: it is a share of light
    - `alpha`: width of the coat's microfacets: the square of what other programs call roughness; must lie between 0 and 1
    - `ior`: index of refraction of the coat; must be finite and positive: 1.5 is glass
    - `specular`: strength of the reflection of the coat; must lie between 0 and 1
    - `nonlinear`: the base colours light at every bounce below the coat; must be one of the known words
    - `beckmann`: microfacets of Beckmann, without long tails, instead of GGX; must be one of the known words
    """


def translucent(
    *,
    reflectance: Union[Color, Texture],
    transmittance: Union[Color, Texture],
) -> Material:
    """Lambert on both sides: light is reflected and transmitted in all directions, as by paper or a leaf.

    - `reflectance`: share of light that is scattered back; must lie between 0 and 1: it is a share of light
    - `transmittance`: share that is scattered to the far side; both together return at most all light; must lie between 0 and 1: it is a share of light
    """


def principled(
    *,
    base_color: Union[Color, Texture] = 0.8,
    metallic: Union[float, Texture] = 0.0,
    roughness: Union[float, Texture] = 0.5,
    ior: float = 1.5,
    specular: Union[float, Texture] = 1.0,
    specular_color: Union[Color, Texture] = 1.0,
    transmission: Union[float, Texture] = 0.0,
    thin_walled: bool = False,
    absorption: Color = 0.0,
    dispersion: float = 0.0,
    anisotropy: Union[float, Texture] = 0.0,
    anisotropy_rotation: float = 0.0,
    anisotropy_map: Union[Color, Texture] = [1.0, 0.5, 1.0],
    sheen_color: Union[Color, Texture] = 0.0,
    sheen_roughness: Union[float, Texture] = 0.5,
    clearcoat: Union[float, Texture] = 0.0,
    clearcoat_roughness: Union[float, Texture] = 0.0,
    clearcoat_normal_map: Union[Color, Texture] = [0.5, 0.5, 1.0],
    iridescence: Union[float, Texture] = 0.0,
    iridescence_ior: float = 1.3,
    iridescence_min: float = 100.0,
    iridescence_max: float = 400.0,
    iridescence_map: Union[float, Texture] = 1.0,
    emission: Union[Color, Texture] = 0.0,
    opacity: Union[float, Texture] = 1.0,
    opacity_cutoff: Optional[float] = None,
    normal_map: Union[Color, Texture] = [0.5, 0.5, 1.0],
    normal_scale: float = 1.0,
    two_sided: bool = True,
) -> Material:
    """Layers with the parameters of glTF 2.0 and of most programs: a clear coat, on a sheen, on a base that is metal, or a dielectric over a diffuse or transmissive layer; see `shading/principled`.

    - `base_color`: albedo, reflectance of metal, tint of transmitted light; must lie between 0 and 1: it is a share of light
    - `metallic`: fraction of metal: 0 is a dielectric, 1 metal; must lie between 0 and 1
    - `roughness`: square root of the GGX width α: 0 is a mirror, 1 rough; must lie between 0 and 1
    - `ior`: index of refraction of the dielectric; must be finite and positive: 1.5 is glass
    - `specular`: strength of the reflection of the dielectric; must lie between 0 and 1
    - `specular_color`: colour of that reflection at normal incidence; must be finite and not negative
    - `transmission`: fraction of the dielectric that transmits: 0 is opaque, 1 glass; must lie between 0 and 1
    - `thin_walled`: transmit as a pane without thickness, unbent; must be one of the known words
    - `absorption`: absorption coefficient inside, 1/m (Beer–Lambert); must be finite and not negative
    - `dispersion`: 20 / Abbe number, of solids: 0.3 to 0.8 for glass, 0.36 for diamond; must be finite and not negative: 20 / Abbe number
    - `anisotropy`: elongation of highlights; α along it is α + (1 − α) · anisotropy²; must lie between 0 and 1
    - `anisotropy_rotation`: direction of elongation, from the direction of u, counter-clockwise; must be finite
    - `anisotropy_map`: red, green: direction, 0.5 is 0; blue: factor of `anisotropy`; must lie between 0 and 1
    - `sheen_color`: reflection of fibres at grazing angles; must lie between 0 and 1: it is a share of light
    - `sheen_roughness`: square root of the width of the sheen: 0 is sharp at the rim, 1 wide; must lie between 0 and 1
    - `clearcoat`: strength of a coat with an index of 1.5; must lie between 0 and 1
    - `clearcoat_roughness`: square root of its GGX width: 0 is a mirror, 1 rough; must lie between 0 and 1
    - `clearcoat_normal_map`: normal map of the coat alone; must lie between 0 and 1
    - `iridescence`: fraction that has a thin film, coloured by interference (Belcour and Barla 2017); must lie between 0 and 1
    - `iridescence_ior`: index of refraction of the film; must be finite and positive: 1.5 is glass
    - `iridescence_min`: thickness of the film where its map is 0, nm; must be finite and not negative
    - `iridescence_max`: thickness of the film where its map is 1, nm; must be finite and not negative
    - `iridescence_map`: interpolates between the two; must lie between 0 and 1
    - `emission`: radiance emitted by the front, W·m⁻²·sr⁻¹; must be finite and not negative
    - `opacity`: coverage: 1 is opaque, 0 is a hole; must lie between 0 and 1
    - `opacity_cutoff`: opaque where `opacity` is at least this, a hole elsewhere; must lie between 0 and 1
    - `normal_map`: tangent-space normals: 0…1 for −1…1; must lie between 0 and 1
    - `normal_scale`: factor of their slope; must be finite
    - `two_sided`: the back is visible and emits; `false`: rays pass through it; must be one of the known words
    """


def disney(
    *,
    base_color: Union[Color, Texture] = 0.5,
    metallic: Union[float, Texture] = 0.0,
    roughness: Union[float, Texture] = 0.5,
    anisotropic: Union[float, Texture] = 0.0,
    ior: float = 1.5,
    specular_tint: Union[float, Texture] = 0.0,
    transmission: Union[float, Texture] = 0.0,
    thin_walled: bool = False,
    diffuse_transmission: Union[float, Texture] = 0.0,
    flatness: Union[float, Texture] = 0.0,
    sheen: Union[float, Texture] = 0.0,
    sheen_tint: Union[float, Texture] = 0.0,
    clearcoat: Union[float, Texture] = 0.0,
    clearcoat_gloss: Union[float, Texture] = 0.0,
) -> Material:
    """The BSDF of Disney as Mitsuba 3 evaluates it in `principled` and `principledthin`; see `shading/disney`.

    - `base_color`: albedo, reflectance of metal, tint of transmitted light; must lie between 0 and 1: it is a share of light
    - `metallic`: fraction of metal: 0 is a dielectric, 1 metal; must lie between 0 and 1
    - `roughness`: square root of the GGX width α, which is at least 0.001; must lie between 0 and 1
    - `anisotropic`: length of highlights along u: α / √(1 − 0.9 anisotropic), and times it across; must lie between 0 and 1
    - `ior`: index of refraction of the dielectric; must be finite and positive: 1.5 is glass
    - `specular_tint`: share of the dielectric's reflection that has the hue of `base_color`; must lie between 0 and 1
    - `transmission`: fraction of the dielectric that transmits: 0 is opaque, 1 glass; must lie between 0 and 1
    - `thin_walled`: a sheet without thickness: `principledthin`, without metal and coat; must be one of the known words
    - `diffuse_transmission`: twice the fraction of a sheet's diffuse light that goes to the far side; must be finite and not negative
    - `flatness`: share of the base that is a thin subsurface layer; must lie between 0 and 1
    - `sheen`: strength of the light that is added at grazing angles; must lie between 0 and 1
    - `sheen_tint`: share of the sheen that has the hue of `base_color`; must lie between 0 and 1
    - `clearcoat`: strength of a coat, of which a quarter is added; must lie between 0 and 1
    - `clearcoat_gloss`: its width: 0 is 0.1, 1 is 0.001; must lie between 0 and 1
    """


def mirror(
    *,
    reflectance: Union[Color, Texture] = 1.0,
) -> Material:
    """Perfect mirror with the same reflectance at every angle.

    - `reflectance`: reflected share, the same at every angle; must lie between 0 and 1: it is a share of light
    """


def metal(
    *,
    alpha: Union[float, Texture],
    reflectance: Union[Color, Texture],
    fresnel: str = 'constant',
    compensate: bool = False,
) -> Material:
    """Isotropic GGX microfacets.

    - `alpha`: GGX width: the square of what other programs call roughness; must lie between 0 and 1
    - `reflectance`: reflected share at normal incidence; must lie between 0 and 1: it is a share of light
    - `fresnel`: `constant`, or `schlick`: rises to 1 at grazing angles; must be one of the known words
    - `compensate`: return the energy that single scattering loses; must be one of the known words
    """


def conductor(
    *,
    alpha: Union[float, Texture] = 0.0,
    alpha_v: Union[float, Texture] = 0.0,
    beckmann: bool = False,
    eta: Color = [0.143, 0.375, 1.442],
    k: Color = [3.983, 2.386, 1.603],
    reflectance: Union[Color, Texture] = 1.0,
    compensate: bool = False,
) -> Material:
    """Microfacets of a metal with the exact Fresnel term of unpolarised light.

    - `alpha`: width of the microfacets: the square of what other programs call roughness; must lie between 0 and 1
    - `alpha_v`: the same along the direction of v, where `alpha` is that of u; 0: `alpha`; must lie between 0 and 1
    - `beckmann`: microfacets of Beckmann, without long tails, instead of GGX; must be one of the known words
    - `eta`: index of refraction, per channel; must be finite and not negative
    - `k`: extinction coefficient, per channel; must be finite and not negative
    - `reflectance`: factor of the reflection; must lie between 0 and 1: it is a share of light
    - `compensate`: return the energy that single scattering of GGX loses; must be one of the known words
    """


def glass(
    *,
    ior: float = 1.5,
    absorption: Color = 0.0,
    dispersion: float = 0.0,
) -> Material:
    """Smooth dielectric with exact Fresnel.

    - `ior`: index of refraction: water 1.33, glass 1.5, diamond 2.4; must be finite and positive: 1.5 is glass
    - `absorption`: absorption coefficient inside, 1/m (Beer–Lambert); must be finite and not negative
    - `dispersion`: 20 / Abbe number: 0.3 to 0.8 for glass, 0.36 for diamond; must be finite and not negative: 20 / Abbe number
    """


def thin_glass(
    *,
    ior: float = 1.5,
    reflectance: Union[Color, Texture] = 1.0,
    transmittance: Union[Color, Texture] = 1.0,
) -> Material:
    """A pane of smooth glass without thickness, with all reflections between its two sides.

    - `ior`: index of refraction: water 1.33, glass 1.5, diamond 2.4; must be finite and positive: 1.5 is glass
    - `reflectance`: factor of reflected light; must lie between 0 and 1: it is a share of light
    - `transmittance`: factor of transmitted light; must lie between 0 and 1: it is a share of light
    """


def rough_glass(
    *,
    alpha: Union[float, Texture],
    ior: float = 1.5,
    absorption: Color = 0.0,
    dispersion: float = 0.0,
    compensate: bool = False,
    beckmann: bool = False,
) -> Material:
    """Dielectric with microfacets that reflect and refract, each with exact Fresnel (Walter et al. 2007).

    - `alpha`: width of the microfacets: the square of what other programs call roughness; must lie between 0 and 1
    - `ior`: index of refraction: water 1.33, glass 1.5, diamond 2.4; must be finite and positive: 1.5 is glass
    - `absorption`: absorption coefficient inside, 1/m (Beer–Lambert); must be finite and not negative
    - `dispersion`: 20 / Abbe number: 0.3 to 0.8 for glass, 0.36 for diamond; must be finite and not negative: 20 / Abbe number
    - `compensate`: return what single scattering of GGX loses (Kulla and Conty 2017); must be one of the known words
    - `beckmann`: microfacets of Beckmann, without long tails, instead of GGX; must be one of the known words
    """


def phong(
    *,
    diffuse: Union[Color, Texture],
    ambient: float = 1.0,
    specular: Union[float, Texture] = 0.0,
    shininess: float = 20.0,
    transparency: float = 0.0,
    ior: float = 1.5,
    absorption: Color = 0.0,
) -> Material:
    """The classic local model. In path tracing it is diffuse, mirror and glass in shares that sum to 1: `transparency`, of the rest `specular`, of the rest `diffuse`.

    - `diffuse`: albedo of what is neither glass nor mirror; must lie between 0 and 1: it is a share of light
    - `ambient`: share of ambient light that `diffuse` reflects; must lie between 0 and 1
    - `specular`: mirrored share of what is not glass; lights appear in it as highlights; must lie between 0 and 1
    - `shininess`: exponent of highlights: 20 is broad, 200 is sharp; must be finite and not negative: 20 is dull, 200 sharp
    - `transparency`: share that is glass; must lie between 0 and 1
    - `ior`: index of refraction of that share; must be finite and positive: 1.5 is glass
    - `absorption`: its absorption coefficient inside, 1/m (Beer–Lambert); must be finite and not negative
    """


def emissive(
    *,
    radiance: Union[Color, Texture],
) -> Material:
    """A black body: emits on its front (a sphere outwards, a face along its normal), reflects nothing.

    - `radiance`: emitted radiance, W·m⁻²·sr⁻¹; must be finite and not negative
    """


def blend(
    *,
    weight: Union[float, Texture],
    a: Union[Material, str],
    b: Union[Material, str],
    by_side: bool = False,
    opacity: Union[float, Texture] = 1.0,
    opacity_cutoff: Optional[float] = None,
    normal_map: Union[Color, Texture] = [0.5, 0.5, 1.0],
    normal_scale: float = 1.0,
    normal_shadowing: bool = False,
) -> Material:
    """f = (1 − weight) f_a + weight f_b, and the same for emission. At most one part is emissive, and then `weight` is constant: see `Emission::of`. Holes and normals are those of the whole: parts have none of their own.

    - `weight`: share of `b`: 0 is only `a`, 1 only `b`; must lie between 0 and 1
    - `a`: the material at weight 0, also another blend; must be one of the known words
    - `b`: the material at weight 1, also another blend; must be one of the known words
    - `by_side`: whatever the weight, `a` is the front and `b` the back; must be one of the known words
    - `opacity`: coverage: 1 is opaque, 0 is a hole; must lie between 0 and 1
    - `opacity_cutoff`: opaque where `opacity` is at least this, a hole elsewhere; must lie between 0 and 1
    - `normal_map`: tangent-space normals: 0…1 for −1…1; must lie between 0 and 1
    - `normal_scale`: factor of their slope; must be finite
    - `normal_shadowing`: mapped normals as in Mitsuba 3, which dims light that grazes them; must be one of the known words
    """
