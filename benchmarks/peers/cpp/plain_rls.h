/* SPDX-License-Identifier: MIT
   Recursive least squares as one writes it in plain C, for PLAIN_N parameters of type PLAIN_REAL; no check, no guard.
   Included once for each type; PLAIN(name) gives the names of that type. It is a header so that a compiler can inline it,
   as it can inline the templates it is compared with. */

/* The upper triangle of P, row by row: Eq. (13) for the elements i <= j only. */
typedef struct {
  PLAIN_REAL theta[PLAIN_N];
  PLAIN_REAL p[PLAIN_N * (PLAIN_N + 1) / 2];
  PLAIN_REAL lambda;
} PLAIN(symmetric);

static inline void PLAIN(symmetric_update)(PLAIN(symmetric) * s, const PLAIN_REAL* phi,
                                           PLAIN_REAL y) {
  PLAIN_REAL weighted[PLAIN_N]; /* P phi */
  PLAIN_REAL alpha = s->lambda;
  PLAIN_REAL error = y;
  int i, j, at = 0;
  for (i = 0; i < PLAIN_N; ++i) {
    weighted[i] = 0;
  }
  for (i = 0; i < PLAIN_N; ++i) {
    weighted[i] += s->p[at++] * phi[i];
    for (j = i + 1; j < PLAIN_N; ++j, ++at) {
      weighted[i] += s->p[at] * phi[j];
      weighted[j] += s->p[at] * phi[i];
    }
  }
  for (i = 0; i < PLAIN_N; ++i) {
    alpha += phi[i] * weighted[i];
    error -= phi[i] * s->theta[i];
  }
  at = 0;
  for (i = 0; i < PLAIN_N; ++i) {
    const PLAIN_REAL k = weighted[i] / alpha;
    s->theta[i] += k * error;
    for (j = i; j < PLAIN_N; ++j, ++at) {
      s->p[at] = (s->p[at] - k * weighted[j]) / s->lambda;
    }
  }
}

/* P = U D U', U with ones on its diagonal, by columns: Bierman, Factorization Methods for Discrete Sequential Estimation,
   1977, ch. V. */
typedef struct {
  PLAIN_REAL theta[PLAIN_N];
  PLAIN_REAL u[PLAIN_N * (PLAIN_N - 1) / 2];
  PLAIN_REAL d[PLAIN_N];
  PLAIN_REAL lambda;
} PLAIN(ud);

static inline void PLAIN(ud_update)(PLAIN(ud) * s, const PLAIN_REAL* phi, PLAIN_REAL y) {
  PLAIN_REAL f[PLAIN_N]; /* U' phi */
  PLAIN_REAL k[PLAIN_N];
  PLAIN_REAL alpha = s->lambda;
  PLAIN_REAL error = y;
  int i, j, at = 0;
  for (j = 0; j < PLAIN_N; ++j) {
    f[j] = phi[j];
    for (i = 0; i < j; ++i, ++at) {
      f[j] += s->u[at] * phi[i];
    }
    error -= phi[j] * s->theta[j];
  }
  at = 0;
  for (j = 0; j < PLAIN_N; ++j) {
    const PLAIN_REAL v = s->d[j] * f[j];
    const PLAIN_REAL before = alpha;
    PLAIN_REAL back;
    alpha += f[j] * v;
    s->d[j] *= before / (alpha * s->lambda);
    back = -f[j] / before;
    k[j] = v;
    for (i = 0; i < j; ++i, ++at) {
      const PLAIN_REAL old = s->u[at];
      s->u[at] = old + back * k[i];
      k[i] += v * old;
    }
  }
  for (i = 0; i < PLAIN_N; ++i) {
    s->theta[i] += k[i] * (error / alpha);
  }
}
