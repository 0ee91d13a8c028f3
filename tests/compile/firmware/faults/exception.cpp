// SPDX-License-Identifier: MIT
void fault() { throw 1; }
