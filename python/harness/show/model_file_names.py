# SPDX-License-Identifier: MIT
"""Names of the files of `model_files`, apart from it because it takes a second to import."""

IDENTIFICATION_FILES = ("identify.json", "identify.png", "identify_bode.png")
ESTIMATION_FILES = ("estimate.json", "estimate.png")
