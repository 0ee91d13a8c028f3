// SPDX-License-Identifier: MIT
// The version of ehsid, in this one place: CMake and the Python package read these lines.
#pragma once

#define EHSID_VERSION_MAJOR 0
#define EHSID_VERSION_MINOR 2
#define EHSID_VERSION_PATCH 0

#define EHSID_VERSION_TEXT_(number) #number
#define EHSID_VERSION_JOIN_(major, minor, patch) \
  EHSID_VERSION_TEXT_(major) "." EHSID_VERSION_TEXT_(minor) "." EHSID_VERSION_TEXT_(patch)

/// "major.minor.patch"
#define EHSID_VERSION_STRING \
  EHSID_VERSION_JOIN_(EHSID_VERSION_MAJOR, EHSID_VERSION_MINOR, EHSID_VERSION_PATCH)
