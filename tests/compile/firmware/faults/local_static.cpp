// SPDX-License-Identifier: MIT
volatile int source = 1;
int fault() {
  static const int kNumber = source;
  return kNumber;
}
