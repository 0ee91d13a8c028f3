// SPDX-License-Identifier: MIT
volatile int source = 1;
int fault = source;
int use() { return fault; }
