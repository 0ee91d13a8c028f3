/* Written by make_headers.py: every exported header, in C++ or in C. */
/* clang-format off */
#ifdef __cplusplus
#include "constant.hpp"
#include "exponential.hpp"
#include "error_driven.hpp"
#include "f_ratio.hpp"
#else
#include "constant.h"
#include "exponential.h"
#include "error_driven.h"
#include "f_ratio.h"
#endif

#undef EXPORTED_CASES
#define EXPORTED_CASES(DO) \
  DO(constant) \
  DO(exponential) \
  DO(error_driven) \
  DO(f_ratio)
/* clang-format on */
