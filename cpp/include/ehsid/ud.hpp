// SPDX-License-Identifier: MIT
// Covariance in factored form, P = U D U', U unit upper triangular, D diagonal and positive.
//
// Source: G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, Academic Press
// 1977, ch. V (measurement update), and the Agee-Turner rank-one update, ch. III.
// Why: the factors keep P symmetric and positive definite by construction in float32, where the
// textbook matrix of Eq. (13) loses both. No square roots.
//
// What an update calls is inlined always: its scratch then shares the stack of the caller's (docs/budgets.md).
#pragma once

#include <ehsid/fields.hpp>
#include <ehsid/groups.hpp>
#include <ehsid/types.hpp>
#include <limits>

namespace ehsid {

/// Factors of a covariance. U is stored by columns without its unit diagonal, n (n - 1) / 2 numbers.
template <class Scalar, int kN>
struct UdFactors : Extent<kN> {
  static_assert(kN != 0, "a covariance needs at least one parameter");
  static constexpr int kMost = capacity(kN);
  static constexpr int kUpper = kMost > 1 ? kMost*(kMost - 1) / 2 : 1;
  using Extent<kN>::size;

  Array<Scalar, kN> d;
  Array<Scalar, kUpper> u;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&UdFactors::d, each_parameter);
    visit(&UdFactors::u, each_pair);
  }

  UdFactors() = default;
  constexpr UdFactors(const Array<Scalar, kN>& d_in, const Array<Scalar, kUpper>& u_in)
      : d(d_in), u(u_in) {}

  static constexpr std::size_t at(int row, int column) {
    return static_cast<std::size_t>(column * (column - 1) / 2 + row);
  }

  /// Takes over factors of the same size.
  EHSID_ALWAYS_INLINE void keep(const UdFactors& from) {
    if constexpr (kUnrolled<kN>) {
      // As they are computed and read, column by column: no load waits for several stores.
      upwards(count_of<kN>(size()), [&](const auto j) EHSID_INLINE_LAMBDA {
        d[static_cast<std::size_t>(j)] = from.d[static_cast<std::size_t>(j)];
        keep_groups(j, from.u.data() + at(0, j), u.data() + at(0, j));
      });
      if constexpr (kN == 1) {
        u = from.u;
      }
    } else if constexpr (kN > 0) {
      *this = from;
    } else {
      const int n = size();
      ehsid::keep<kN>(n, from.d, d);
      ehsid::keep<kN>(n * (n - 1) / 2, from.u, u);
    }
  }

  /// P = diag(variances). False, and factors unchanged, unless every variance is finite and > 0.
  bool set_diagonal(const Vector<Scalar, kN>& variances) {
    if (!this->accepts(variances.size())) {
      return false;
    }
    const auto n = static_cast<int>(variances.size());
    for (int j = 0; j < n; ++j) {
      if (!is_finite(variances[j]) || !(variances[j] > Scalar(0))) {
        return false;
      }
    }
    if constexpr (kN < 0) {
      d.fill(Scalar(0));  // what lies behind n stays zero
    }
    this->resize(n);
    for (int j = 0; j < n; ++j) {
      d[static_cast<std::size_t>(j)] = variances[j];
    }
    u.fill(Scalar(0));
    return true;
  }

  /// Factorises a symmetric positive definite matrix (its upper triangle is read).
  /// False, and factors unchanged, if the matrix is not positive definite or not finite.
  bool factorise(const SquareMatrix<Scalar, kN>& covariance) {
    if (covariance.rows() != covariance.cols() || !this->accepts(covariance.rows())) {
      return false;
    }
    const auto n = static_cast<int>(covariance.rows());
    SquareMatrix<Scalar, kN> rest = covariance;
    UdFactors next{};
    next.resize(n);
    for (int j = n - 1; j >= 0; --j) {
      const Scalar pivot = rest(j, j);
      // A pivot lost in the rounding of the diagonal means: singular in this precision.
      const Scalar rounding = Scalar(n) * std::numeric_limits<Scalar>::epsilon() * covariance(j, j);
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
    const int n = size();
    SquareMatrix<Scalar, kN> p(n, n);
    for (int i = 0; i < n; ++i) {
      for (int j = i; j < n; ++j) {
        Scalar sum = unit_upper(i, j) * d[static_cast<std::size_t>(j)];
        for (int k = j + 1; k < n; ++k) {
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
    const int n = size();
    const Scalar* factor = &u[0] + i * (i + 1) / 2 + i;
    EHSID_UNROLL
    for (int k = i + 1; k < n; ++k) {
      sum += *factor * *factor * d[static_cast<std::size_t>(k)];
      factor += k;
    }
    return sum;
  }

  /// f = U' phi; returns phi' P phi = f' D f.
  template <class Regressor>
  EHSID_ALWAYS_INLINE Scalar project(const Regressor& phi, Array<Scalar, kN>& f) const {
    f[0] = phi[0];
    Scalar s = f[0] * (d[0] * f[0]);
    const int n = size();
    const Scalar* column = u.data();
    EHSID_UNROLL
    for (int j = 1; j < n; ++j) {
      const auto jj = static_cast<std::size_t>(j);
      Scalar sum = entry(phi, j);
      EHSID_UNROLL
      for (int i = 0; i < j; ++i) {
        sum += column[i] * entry(phi, i);
      }
      f[jj] = sum;
      s += sum * (d[jj] * sum);
      column += j;
    }
    return s;
  }

  /// Bierman's measurement update of `prior`, itself or another, with measurement variance r, then divided by `shrink`:
  ///   P <- (P - P phi phi' P / alpha) / shrink,   alpha = r + phi' P phi.
  /// With r = shrink = lambda this is Eq. (13). `f` is U' phi of `prior`, and becomes its P phi: divided by alpha,
  /// which is returned, it is the gain P(k) phi(k) of Eq. (14). `all` becomes all P_ii.
  EHSID_ALWAYS_INLINE Scalar measure(const UdFactors& prior, Array<Scalar, kN>& f, const Scalar& r,
                                     const Scalar& shrink, Array<Scalar, kN>& all) {
    if constexpr (kN == 1) {
      u = prior.u;  // no factor, but a number that usable() reads
    }
    this->resize(prior.size());
    Scalar alpha = r;
    upwards(count_of<kN>(prior.size()), [&](const auto j) EHSID_INLINE_LAMBDA {
      const auto jj = static_cast<std::size_t>(j);
      const Scalar* from = prior.u.data() + at(0, j);
      Scalar* to = u.data() + at(0, j);
      const Scalar before = alpha;
      const Scalar v = prior.d[jj] * f[jj];
      alpha += f[jj] * v;
      const Scalar slope = f[jj] / before;
      const Scalar dj = prior.d[jj] * before / (alpha * shrink);
      in_groups<Scalar>(j, [&](const auto group) EHSID_INLINE_LAMBDA {
        const auto old = group.load(from);
        const auto k = group.gather(f.data());
        const auto factor = old - k * slope;
        group.store(factor, to);
        group.scatter(k + v * old, f.data());
        group.scatter(group.gather(all.data()) + factor * factor * dj, all.data());
      });
      d[jj] = dj;
      all[jj] = dj;
      f[jj] = v;
    });
    return alpha;
  }

  /// All P_ii. Each is a sum over its row; the columns come one after another, so that several rows are summed at once.
  EHSID_ALWAYS_INLINE void variances(Array<Scalar, kN>& all) const {
    upwards(count_of<kN>(size()), [&](const auto j) EHSID_INLINE_LAMBDA {
      const Scalar dj = d[static_cast<std::size_t>(j)];
      const Scalar* column = u.data() + at(0, j);
      in_groups<Scalar>(j, [&](const auto group) EHSID_INLINE_LAMBDA {
        const auto factor = group.load(column);
        group.scatter(group.gather(all.data()) + factor * factor * dj, all.data());
      });
      all[static_cast<std::size_t>(j)] = dj;
    });
  }

  /// sum_i weights_i P_ii, weights >= 0.
  EHSID_ALWAYS_INLINE Scalar weighted_trace(const Array<Scalar, kN>& weights) const {
    Array<Scalar, kN> all{};
    variances(all);
    return dot(size(), weights, all);
  }

  /// P <- factor P.
  void scale(const Scalar& factor) {
    const int n = size();
    EHSID_UNROLL
    for (int i = 0; i < n; ++i) {
      d[static_cast<std::size_t>(i)] *= factor;
    }
  }

  /// Every number finite, every d a normal positive one, and every P_ii finite.
  bool usable() const {
    const int n = size();
    if (!this->accepts(n)) {
      return false;
    }
    bool good = all_finite(n > 1 ? n * (n - 1) / 2 : 1, u);
    for (int i = 0; i < n; ++i) {
      good = is_normal_positive(d[static_cast<std::size_t>(i)]) && is_finite(variance(i)) && good;
    }
    return good;
  }

 private:
  Scalar unit_upper(int row, int column) const {
    return row == column ? Scalar(1) : u[at(row, column)];
  }
};

}  // namespace ehsid
