/* SPDX-License-Identifier: MIT
 * y(k) = 0.9 y(k-1) + 0.1 u(k-1) through the controller of docs/linking.md. */
#include <ehsid/c_api.h>

ehsid_status power_on(void);
bool every_sample(float command_v, float position_m, float* b1);

int main(void) {
  float y = 0.0F;
  float b1 = 0.0F;
  bool usable = false;
  if (power_on() != EHSID_OK) {
    return 1;
  }
  for (int k = 0; k < 2000; ++k) {
    const float u = k % 7 < 3 ? 1.0F : -1.0F;
    usable = every_sample(u, y, &b1);
    y = 0.9F * y + 0.1F * u;
  }
  return usable && b1 > 0.099F && b1 < 0.101F ? 0 : 2;
}
