/* SPDX-License-Identifier: MIT
 * Every use of an exported servo_estimator.c, for an analysis of all values that there can be:
 *   frama-c -eva -eva-precision 3 -warn-special-float none any_use.c
 * The calls come in any order and number, with any samples, NaN and infinite ones among them. */
#include "servo_estimator.c"

extern volatile servo_real any_real;
extern volatile int any_choice;

static servo_real any_number(void) {
  /* any_real is finite, these quotients are NaN and infinite, too. */
  return any_choice != 0 ? any_real : any_real / any_real;
}

int main(void) {
  servo_state state;
  servo_state saved;
  servo_real numbers[SERVO_N];
  (void)servo_self_test();
  servo_init(&state);
  saved = state;
  //@ widen_hints global:"all", 1, 2, 5, 6, 9, 10, 20, 50, 99, 100, 200, 300, 1048576;
  while (any_choice != 0) {
    switch (any_choice) {
      case 1: saved = state; break;
      case 2: state = saved; break;
      case 3: servo_enable(&state, any_choice != 0); break;
      case 4: servo_reset(&state); break;
      case 5: servo_theta(&state, numbers); break;
      case 6: servo_deviations(&state, numbers); break;
      case 7: numbers[0] = servo_innovation(&state) + servo_lambda(&state) + servo_residual_variance(&state); break;
      case 8: (void)servo_settled(&state); (void)servo_converged(&state); break;
      default: (void)servo_step(&state, any_number(), any_number()); break;
    }
  }
  return 0;
}
