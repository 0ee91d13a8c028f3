// SPDX-License-Identifier: MIT
// Covariance in factored form, P = U D U', U unit upper triangular, D diagonal and positive.
//
// Source: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press
// 1977, ch. V (measurement update), and the Agee-Turner rank-one update, ch. III.
// Why: the factors keep P symmetric and positive definite by construction in float32, where the
// textbook matrix of Eq. (13) loses both. No square roots.
#pragma once

#include <ehsid/types.hpp>
#include <limits>

namespace ehsid {

/// phi seen through the factors: f = U' phi, v = D f and s = phi' P phi = f' v.
template <class Scalar, int kN>
struct Projection {
  Array<Scalar, kN> f;
  Array<Scalar, kN> v;
  Scalar s;
};

/// Factors of a covariance. U is stored by columns without its unit diagonal, kN (kN - 1) / 2 numbers.
template <class Scalar, int kN>
struct UdFactors {
  static_assert(kN >= 1, "a covariance needs at least one parameter");
  static constexpr int kUpper = kN > 1 ? kN*(kN - 1) / 2 : 1;

  Array<Scalar, kN> d;
  Array<Scalar, kUpper> u;

  static constexpr std::size_t at(int row, int column) {
    return static_cast<std::size_t>(column * (column - 1) / 2 + row);
  }

  /// P = diag(variances). False, and factors unchanged, unless every variance is finite and > 0.
  bool set_diagonal(const Vector<Scalar, kN>& variances) {
    for (int j = 0; j < kN; ++j) {
      if (!is_finite(variances[j]) || !(variances[j] > Scalar(0))) {
        return false;
      }
    }
    for (int j = 0; j < kN; ++j) {
      d[static_cast<std::size_t>(j)] = variances[j];
    }
    u.fill(Scalar(0));
    return true;
  }

  /// Factorises a symmetric positive definite matrix (its upper triangle is read).
  /// False, and factors unchanged, if the matrix is not positive definite or not finite.
  bool factorise(const SquareMatrix<Scalar, kN>& covariance) {
    SquareMatrix<Scalar, kN> rest = covariance;
    UdFactors next{};
    for (int j = kN - 1; j >= 0; --j) {
      const Scalar pivot = rest(j, j);
      // A pivot lost in the rounding of the diagonal means: singular in this precision.
      const Scalar rounding =
          Scalar(kN) * std::numeric_limits<Scalar>::epsilon() * covariance(j, j);
      if (!is_finite(pivot) || !(pivot > rounding)) {
        return false;
      }
      next.d[static_cast<std::size_t>(j)] = pivot;
      for (int i = 0; i < j; ++i) {
        const Scalar factor = rest(i, j) / pivot;
        next.u[at(i, j)] = factor;
        for (int k = 0; k <= i; ++k) {
          rest(k, i) -= factor * rest(k, j);
        }
      }
    }
    if (!next.usable()) {
      return false;
    }
    *this = next;
    return true;
  }

  /// P = U D U', for people and for tests; the recursion never forms it.
  SquareMatrix<Scalar, kN> matrix() const {
    SquareMatrix<Scalar, kN> p;
    for (int i = 0; i < kN; ++i) {
      for (int j = i; j < kN; ++j) {
        Scalar sum = unit_upper(i, j) * d[static_cast<std::size_t>(j)];
        for (int k = j + 1; k < kN; ++k) {
          sum += u[at(i, k)] * d[static_cast<std::size_t>(k)] * u[at(j, k)];
        }
        p(i, j) = sum;
        p(j, i) = sum;
      }
    }
    return p;
  }

  /// P_ii of one parameter.
  Scalar variance(int i) const {
    Scalar sum = d[static_cast<std::size_t>(i)];
    for (int k = i + 1; k < kN; ++k) {
      const Scalar factor = u[at(i, k)];
      sum += factor * factor * d[static_cast<std::size_t>(k)];
    }
    return sum;
  }

  Projection<Scalar, kN> project(const Vector<Scalar, kN>& phi) const {
    Projection<Scalar, kN> p;
    p.s = Scalar(0);
    for (int j = 0; j < kN; ++j) {
      const auto jj = static_cast<std::size_t>(j);
      Scalar sum = phi[j];
      for (int i = 0; i < j; ++i) {
        sum += u[at(i, j)] * phi[i];
      }
      p.f[jj] = sum;
      p.v[jj] = d[jj] * sum;
      p.s += sum * p.v[jj];
    }
    return p;
  }

  /// Bierman's measurement update with measurement variance r, then P divided by `shrink`:
  ///   P <- (P - P phi phi' P / (r + phi' P phi)) / shrink,   gain = P phi / (r + phi' P phi).
  /// With r = shrink = lambda this is Eq. (13) and the P(k) phi(k) of Eq. (14).
  void measure(const Projection<Scalar, kN>& p, Scalar r, Scalar shrink, Array<Scalar, kN>& gain) {
    Scalar alpha = r;
    for (int j = 0; j < kN; ++j) {
      const auto jj = static_cast<std::size_t>(j);
      const Scalar before = alpha;
      alpha += p.f[jj] * p.v[jj];
      const Scalar slope = -p.f[jj] / before;
      d[jj] = d[jj] * before / (alpha * shrink);
      for (int i = 0; i < j; ++i) {
        const auto ii = static_cast<std::size_t>(i);
        const Scalar old = u[at(i, j)];
        u[at(i, j)] = old + gain[ii] * slope;
        gain[ii] += p.v[jj] * old;
      }
      gain[jj] = p.v[jj];
    }
    for (int j = 0; j < kN; ++j) {
      gain[static_cast<std::size_t>(j)] /= alpha;
    }
  }

  /// Agee-Turner: P <- P + c a a', c >= 0. Overwrites a with U^-1 a (U before the update).
  void add_rank_one(Scalar c, Array<Scalar, kN>& a) {
    for (int j = kN - 1; j >= 0; --j) {
      const auto jj = static_cast<std::size_t>(j);
      const Scalar grown = d[jj] + c * a[jj] * a[jj];
      const Scalar slope = c * a[jj] / grown;
      for (int i = 0; i < j; ++i) {
        const auto ii = static_cast<std::size_t>(i);
        a[ii] -= a[jj] * u[at(i, j)];
        u[at(i, j)] += slope * a[ii];
      }
      c *= d[jj] / grown;
      d[jj] = grown;
    }
  }

  /// phi' P^-1 phi: the information already held along phi.
  Scalar information_along(const Vector<Scalar, kN>& phi) const {
    Array<Scalar, kN> z;
    Scalar sum(0);
    for (int i = kN - 1; i >= 0; --i) {
      const auto ii = static_cast<std::size_t>(i);
      z[ii] = phi[i];  // back substitution, U z = phi
      for (int j = i + 1; j < kN; ++j) {
        z[ii] -= u[at(i, j)] * z[static_cast<std::size_t>(j)];
      }
      sum += z[ii] * z[ii] / d[ii];
    }
    return sum;
  }

  /// P <- factor P.
  void scale(Scalar factor) {
    for (Scalar& value : d) {
      value *= factor;
    }
  }

  /// Every number finite and every d a normal positive one.
  bool usable() const {
    bool good = all_finite<kN>(d) && all_finite<kUpper>(u);
    for (const Scalar value : d) {
      good = value >= std::numeric_limits<Scalar>::min() && good;
    }
    return good;
  }

 private:
  Scalar unit_upper(int row, int column) const {
    return row == column ? Scalar(1) : u[at(row, column)];
  }
};

}  // namespace ehsid
