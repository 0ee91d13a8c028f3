# SPDX-License-Identifier: MIT
import numpy as np
from made_claims import made_claims
from matplotlib.colors import to_hex

from ehsid.lab.studies.claims import Finding
from ehsid.lab.studies.pages.claims_sections import COLOURS, claims_map, claims_picture
from ehsid.lab.studies.verdicts import CLAIMS


def test_the_map_has_a_cell_of_the_right_colour_for_each_condition() -> None:
    claims = made_claims()
    figure = claims_map(claims.judged, claims.resets, claims.verdicts)
    *maps, resets, _ = figure.get_axes()
    assert len(maps) == len(CLAIMS)
    inputs = list(dict.fromkeys(one.condition.input for one in claims.judged))
    values = {
        name: sorted({getattr(one.condition, name) for one in claims.judged})
        for name in ("noise", "lambda0", "p0")
    }
    for axes, of in zip(maps, CLAIMS.values(), strict=True):
        (image,) = axes.get_images()
        shown = image.cmap(image.norm(image.get_array()))
        assert shown.shape[:2] == (
            len(inputs) * len(values["noise"]),
            len(values["lambda0"]) * len(values["p0"]),
        )
        for one in claims.judged:
            at = one.condition
            row = inputs.index(at.input) * len(values["noise"]) + values["noise"].index(at.noise)
            column = values["lambda0"].index(at.lambda0) * len(values["p0"])
            colour = shown[row, column + values["p0"].index(at.p0)]
            wanted = COLOURS[of(one).finding]
            assert to_hex(colour) == to_hex(wanted)
    (image,) = resets.get_images()
    assert np.asarray(image.get_array()).size == len(claims.resets)


def test_each_finding_has_a_colour_of_its_own() -> None:
    assert len({to_hex(colour) for colour in COLOURS.values()}) == len(Finding)


def test_the_picture_says_the_verdict_on_each_claim() -> None:
    claims = made_claims()
    picture = claims_picture(claims.judged, claims.resets, claims.verdicts)
    for verdict in claims.verdicts:
        assert f"{verdict.claim}: {verdict.verdict.value}" in picture.alt
