// SPDX-License-Identifier: MIT
// Vectors and matrices of a program without Eigen: as much of Eigen's interface as the headers for a controller use.
// EHSID_WITHOUT_EIGEN chooses them, for all of a program.
#pragma once

#include <array>
#include <cstddef>

namespace ehsid {

/// kRows times kColumns numbers, column by column. Sizes are static; `[i]` is for a vector. Nothing checks an index.
template <class Scalar_, int kRows, int kColumns>
class PlainMatrix {
 public:
  static_assert(kRows > 0 && kColumns > 0, "without Eigen sizes are static");
  using Scalar = Scalar_;
  static constexpr int kSize = kRows * kColumns;

  PlainMatrix() = default;
  /// Of these sizes, which are the static ones.
  explicit constexpr PlainMatrix(int /*size*/) {}
  constexpr PlainMatrix(int /*rows*/, int /*columns*/) {}
  /// All numbers, of which there are at least four, column by column.
  template <class... More>
  constexpr PlainMatrix(const Scalar& a, const Scalar& b, const Scalar& c, const Scalar& d,
                        const More&... more)
      : numbers_{a, b, c, d, more...} {
    static_assert(sizeof...(More) + 4 == static_cast<std::size_t>(kSize), "give every number");
  }

  static constexpr PlainMatrix Constant(const Scalar& value) {
    PlainMatrix all;
    for (Scalar& number : all.numbers_) {
      number = value;
    }
    return all;
  }
  static constexpr PlainMatrix Constant(int /*size*/, const Scalar& value) {
    return Constant(value);
  }
  static constexpr PlainMatrix Zero() { return Constant(Scalar(0)); }
  static constexpr PlainMatrix Zero(int /*size*/) { return Zero(); }

  static constexpr int rows() { return kRows; }
  static constexpr int cols() { return kColumns; }
  static constexpr int size() { return kSize; }
  const Scalar* data() const { return numbers_.data(); }
  Scalar* data() { return numbers_.data(); }

  constexpr const Scalar& operator[](int i) const { return numbers_[static_cast<std::size_t>(i)]; }
  constexpr Scalar& operator[](int i) { return numbers_[static_cast<std::size_t>(i)]; }
  constexpr const Scalar& operator()(int row, int column) const {
    return (*this)[column * kRows + row];
  }
  constexpr Scalar& operator()(int row, int column) { return (*this)[column * kRows + row]; }

  friend bool operator==(const PlainMatrix& a, const PlainMatrix& b) {
    return a.numbers_ == b.numbers_;
  }
  friend bool operator!=(const PlainMatrix& a, const PlainMatrix& b) { return !(a == b); }

 private:
  std::array<Scalar, static_cast<std::size_t>(kSize)> numbers_{};
};

}  // namespace ehsid
