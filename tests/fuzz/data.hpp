// SPDX-License-Identifier: MIT
// What the fuzz targets share: numbers taken from the bytes of an input, and a check that ends the program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace fuzz {

/// Ends the program where the condition is false: libFuzzer then keeps the input.
inline void check(bool condition, const char* what) {
  if (!condition) {
    std::fprintf(stderr, "fuzz: this does not hold: %s\n", what);
    std::abort();
  }
}

/// The bytes of an input as numbers, one behind the other. Beyond the end every number is 0.
class Data {
 public:
  Data(const std::uint8_t* bytes, std::size_t count) : bytes_(bytes), left_(count) {}

  bool empty() const { return left_ == 0; }
  const std::uint8_t* bytes() const { return bytes_; }
  std::size_t left() const { return left_; }

  template <class Number>
  Number next() {
    Number value{};
    const std::size_t count = left_ < sizeof value ? left_ : sizeof value;
    if (count > 0) {
      std::memcpy(&value, bytes_, count);
    }
    skip(count);
    return value;
  }

  /// A whole number from 0 to `most`, at most 255.
  int up_to(int most) { return next<std::uint8_t>() % (most + 1); }

  /// One out of two.
  bool coin() { return up_to(1) == 1; }

  /// A number that is often ordinary, and otherwise any pattern of bits: NaN, Inf and denormal numbers too.
  float real() {
    const int kind = up_to(3);
    if (kind == 0) {
      return next<float>();
    }
    const auto small = static_cast<float>(next<std::int8_t>());
    return kind == 1 ? small : kind == 2 ? small / 64.0F : small * 1e-6F;
  }

  /// Passes over `count` bytes, no more than left().
  void skip(std::size_t count) {
    bytes_ += count;
    left_ -= count;
  }

 private:
  const std::uint8_t* bytes_;
  std::size_t left_;
};

}  // namespace fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count);
