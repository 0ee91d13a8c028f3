// SPDX-License-Identifier: MIT
float* fault() { return new float[16]; }
