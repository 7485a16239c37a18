"""What people call the keys of a case elsewhere: symbols of ISO 21771 and 6336, German words, other programs' names."""

from __future__ import annotations

# Spelling, in lower case and without unit -> stem of the key here. Ambiguous words are left out.
MEANINGS: dict[str, str] = {
    "z": "teeth",
    "z1": "teeth",
    "z2": "teeth",
    "number_of_teeth": "teeth",
    "n_teeth": "teeth",
    "num_teeth": "teeth",
    "tooth_number": "teeth",
    "zahnzahl": "teeth",
    "zaehnezahl": "teeth",
    "zähnezahl": "teeth",
    "m": "module_mm",
    "mn": "module_mm",
    "m_n": "module_mm",
    "modul": "module_mm",
    "normal_module": "module_mm",
    "alpha": "pressure_angle_deg",
    "alpha_n": "pressure_angle_deg",
    "eingriffswinkel": "pressure_angle_deg",
    "x": "profile_shift",
    "x1": "profile_shift",
    "x2": "profile_shift",
    "shift": "profile_shift",
    "profilverschiebung": "profile_shift",
    "b": "face_width_mm",
    "b1": "face_width_mm",
    "b2": "face_width_mm",
    "width": "face_width_mm",
    "facewidth": "face_width_mm",
    "zahnbreite": "face_width_mm",
    "breite": "face_width_mm",
    "a": "centre_distance_mm",
    "aw": "centre_distance_mm",
    "a_w": "centre_distance_mm",
    "center_distance": "centre_distance_mm",
    "achsabstand": "centre_distance_mm",
    "da": "tip_diameter_mm",
    "d_a": "tip_diameter_mm",
    "kopfkreisdurchmesser": "tip_diameter_mm",
    "outside_diameter": "tip_diameter_mm",
    "ha": "addendum",
    "h_ap": "addendum",
    "hf": "dedendum",
    "h_fp": "dedendum",
    "rho_fp": "rack_tip_radius",
    "mass": "mass_kg",
    "masse": "mass_kg",
    "j": "inertia_kg_m2",
    "moment_of_inertia": "inertia_kg_m2",
    "traegheitsmoment": "inertia_kg_m2",
    "e": "youngs_modulus_gpa",
    "e_modul": "youngs_modulus_gpa",
    "e_modulus": "youngs_modulus_gpa",
    "young": "youngs_modulus_gpa",
    "nu": "poisson",
    "poisson_ratio": "poisson",
    "poissons_ratio": "poisson",
    "querkontraktionszahl": "poisson",
    "rho": "density_kg_m3",
    "dichte": "density_kg_m3",
    "mu": "coefficient",
    "reibwert": "coefficient",
    "k": "stiffness_n_per_m",
    "steifigkeit": "stiffness_n_per_m",
    "c": "damping_n_s_per_m",
    "daempfung": "damping_n_s_per_m",
    "torque": "torque_mean_nm",
    "drehmoment": "torque_mean_nm",
    "t1": "torque_mean_nm",
    "rpm": "speed_driver_rpm",
    "speed": "speed_driver_rpm",
    "drehzahl": "speed_driver_rpm",
    "n1": "speed_driver_rpm",
    "fs": "sampling_rate_hz",
    "sample_rate": "sampling_rate_hz",
    "sampling_frequency": "sampling_rate_hz",
    "abtastrate": "sampling_rate_hz",
    "fr": "runout_um",
    "f_r": "runout_um",
    "rundlauf": "runout_um",
    "eccentricity": "runout_um",
    "ca": "tip_relief_um",
    "c_alpha": "tip_relief_um",
    "kopfruecknahme": "tip_relief_um",
}
# Units that may follow such a word; the key itself says in which unit the value must be.
_UNITS = ("_mm", "_um", "_m", "_deg", "_rad", "_gpa", "_mpa", "_kg", "_nm", "_hz", "_rpm")


def meant(key: str) -> str | None:
    """The key that a word from elsewhere means, None if it is not known."""
    word = key.lower().replace("-", "_")
    if word in MEANINGS:
        return MEANINGS[word]
    for unit in _UNITS:
        if word.endswith(unit) and word.removesuffix(unit) in MEANINGS:
            return MEANINGS[word.removesuffix(unit)]
    return None
