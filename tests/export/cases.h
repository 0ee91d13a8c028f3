/* Written by make_headers.py: every exported header, in C++ or in C. */
/* clang-format off */
#ifdef __cplusplus
#include "constant.hpp"
#include "exponential.hpp"
#include "error_driven.hpp"
#include "f_ratio.hpp"
#include "directional.hpp"
#include "random_walk.hpp"
#else
#include "constant.h"
#include "exponential.h"
#include "error_driven.h"
#include "f_ratio.h"
#include "directional.h"
#include "random_walk.h"
#endif

#undef EXPORTED_CASES
#define EXPORTED_CASES(DO) \
  DO(constant) \
  DO(exponential) \
  DO(error_driven) \
  DO(f_ratio) \
  DO(directional) \
  DO(random_walk)
/* clang-format on */
