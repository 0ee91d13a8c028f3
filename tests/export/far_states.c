/* SPDX-License-Identifier: MIT
 * Branches of an exported servo_estimator.c that no samples of the tests reach: states far beyond what a start and
 * samples within the input limit lead to. Included behind servo_estimator.c, for a measure of branch coverage. */
static servo_state far_state(void) {
  servo_state state;
  servo_init(&state);
  state.filled = FULL;
  for (int32_t i = 0; i < UPPER; ++i) state.u[i] = 0;
  for (int32_t i = 0; i < N; ++i) state.theta[i] = 0;
  return state;
}

/* A sample whose regressor is phi, then zeros. */
static void sample_of(servo_state state, real phi, real y) {
  state.outputs[0] = -phi;
  (void)servo_step(&state, COMMAND_OFFSET, y * POSITION_SCALE + POSITION_OFFSET);
}

/* Starving for long, without a surprise, after large errors. */
static servo_state starved(void) {
  servo_state state = far_state();
  for (int32_t i = 0; i < N; ++i) {
    state.regained[i] = (real)1e-7;
    state.d[i] = (real)1e-14;
  }
  state.waited = 0;
  state.usual_square = (real)1e19;
  state.mean_square = 1;
  state.weight = 100;
  return state;
}

void far_states(void) {
  servo_state state = far_state();
  real numbers[N];
  /* Readings beyond the largest number, of either sign; before any sample; settled, but not white. */
  state.innovation = LARGEST;
  (void)servo_innovation(&state);
  state.innovation = -LARGEST;
  (void)servo_innovation(&state);
  state.mean_square = (real)1e19;
  for (int32_t i = 0; i < N; ++i) state.d[i] = (real)1e25;
  servo_deviations(&state, numbers);
  state.coloured = true;
  state.steady = HOLD;
  state.samples = ENOUGH;
  (void)servo_converged(&state);
  state.weight = 0;
  servo_deviations(&state, numbers);
  servo_reset(&state);
  (void)servo_step(&state, (real)NAN, 0);
  /* The square, phi' P phi, the mean of P, theta and d beyond their limits. */
  state = far_state();
  state.theta[0] = (real)9e18;
  sample_of(state, (real)1e4, 0);
  state = far_state();
  state.d[0] = LARGEST;
  sample_of(state, (real)1e4, 0);
  state = far_state();
  state.d[NA] = (real)1e30;
  state.u[(NA * (NA - 1)) / 2 + 1] = (real)1e18;
  sample_of(state, 1, 0);
  state = far_state();
  state.remainder[0] = (real)1e30;
  sample_of(state, 1, 0);
  state = far_state();
  state.d[N - 1] = 0;
  sample_of(state, 1, 0);
  state = far_state();
  state.weight = 0;
  state.d[1] = 4 * N * RESET_D * CEILING;
  sample_of(state, 1, 1);
  /* The square passes its limit where the forgetting of the step is postponed. */
  state = starved();
  state.waited = 1;
  state.d[0] = 1;
  state.theta[0] = (real)-3.0377e9;
#ifdef ETA
  state.windows_seen = LONG;
#endif
  sample_of(state, (real)1e3, 0);
  sample_of(starved(), 10, 5);
  /* Samples that are left out: the errors have fallen or not, small and large regressors, P at its ceiling. */
  sample_of(starved(), (real)0.1, 0);
  state = starved();
  state.theta[0] = 10;
  sample_of(state, (real)0.1, 1);
  sample_of(starved(), (real)1e-6, 0);
  for (int32_t i = 1; i < N - 1; ++i) state.d[i] = 2 * N * RESET_D * CEILING;
  sample_of(state, (real)0.1, 1);
  state.weight = 0;
  state.d[0] = 0;
  sample_of(state, (real)0.1, 0);
#ifdef MEMORY
  state = far_state();
  state.errors_seen = 20;
  sample_of(state, 1, 1);
  state.errors_seen = 1048576;
  sample_of(state, 1, 1);
#endif
}
