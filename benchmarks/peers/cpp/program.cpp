// SPDX-License-Identifier: MIT
// All recursions in one process, on the samples of a file: commands and positions, float64, first all u and then all y.
//
//   peers theta FILE NA NB LAMBDA VARIANCE0 K...      parameters after K samples
//   peers time FILE NA NB LAMBDA VARIANCE0 PASSES     ns an update, each pass; the recursions take turns
//   peers hold FILE NA NB LAMBDA VARIANCE0 EXCITED    samples behind EXCITED until the parameters have moved or are no numbers
//
// One JSON object a line and recursion.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "families.hpp"

namespace {

using peers::Entries;
using peers::Entry;
using peers::Prior;
using peers::Sample;
using peers::Settings;

constexpr double kMoved = 0.01;  // of the largest parameter

/// The samples of an ARX model with nk = 1, from the first one with a complete past.
class Samples {
 public:
  Samples(const char* path, int na, int nb) : na_(na), nb_(nb) {
    std::FILE* file = std::fopen(path, "rb");
    if (file == nullptr) {
      std::fprintf(stderr, "peers: %s cannot be read\n", path);
      std::exit(2);
    }
    double value = 0.0;
    while (std::fread(&value, sizeof value, 1, file) == 1) {
      signals_.push_back(value);
    }
    std::fclose(file);
    half_ = signals_.size() / 2;
    first_ = static_cast<std::size_t>(na > nb ? na : nb);
    phi_.resize(static_cast<std::size_t>(na + nb));
  }

  std::size_t first() const { return first_; }
  std::size_t size() const { return half_; }
  std::size_t parameters() const { return phi_.size(); }
  /// The regressor is valid until the next call. The samples before first() are for an estimator with a memory of its own.
  Sample at(std::size_t k) {
    const double* u = signals_.data();
    const double* y = u + half_;
    for (int i = 1; i <= na_ && k >= first_; ++i) {
      phi_[static_cast<std::size_t>(i - 1)] = -y[k - static_cast<std::size_t>(i)];
    }
    for (int i = 1; i <= nb_ && k >= first_; ++i) {
      phi_[static_cast<std::size_t>(na_ + i - 1)] = u[k - static_cast<std::size_t>(i)];
    }
    return {phi_.data(), y[k], u[k]};
  }

 private:
  int na_;
  int nb_;
  std::vector<double> signals_;
  std::size_t half_ = 0;
  std::size_t first_ = 0;
  std::vector<double> phi_;
};

template <int... kSizes>
void add_static_sizes(Entries& entries, int n, std::integer_sequence<int, kSizes...> /*sizes*/) {
  (void(n == kSizes ? (peers::add_textbook<kSizes>(entries), peers::add_ours<kSizes>(entries))
                    : void()),
   ...);
}

Entries entries_for(int n) {
  Entries entries;
  add_static_sizes(entries, n, std::integer_sequence<int, PEERS_SIZES>{});
#ifdef PEERS_DLIB
  peers::add_dlib(entries, n);
#endif
#ifdef PEERS_LIQUID
  peers::add_liquid(entries, n);
#endif
  return entries;
}

void open_line(const Entry& entry, const Prior& prior) {
  std::printf(
      "{\"name\": \"%s\", \"scalar\": \"%s\", \"ours\": %s, \"variance0\": %.17g, \"kept\": %s",
      entry.name.c_str(), entry.scalar.c_str(), entry.ours ? "true" : "false", prior.variance0,
      prior.kept ? "true" : "false");
}

void print_list(const std::vector<double>& values) {
  std::printf("[");
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::printf(i == 0 ? "" : ", ");
    std::printf(std::isfinite(values[i]) ? "%.17g" : "null", values[i]);
  }
  std::printf("]");
}

/// Updates with sample k, where the recursion can take it.
void feed(Entry& entry, Samples& samples, std::size_t k) {
  if (k >= samples.first() || entry.peer->makes_regressor()) {
    entry.peer->update(samples.at(k));
  }
}

void print_theta(Entry& entry, Samples& samples, const Settings& settings,
                 const std::vector<std::size_t>& counts) {
  open_line(entry, entry.peer->start(settings));
  std::vector<double> theta(samples.parameters());
  std::size_t k = 0;
  std::printf(", \"theta\": {");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    for (; k < counts[i] && k < samples.size(); ++k) {
      feed(entry, samples, k);
    }
    entry.peer->theta(theta.data());
    std::printf(i == 0 ? "\"%zu\": " : ", \"%zu\": ", counts[i]);
    print_list(theta);
  }
  std::printf("}}\n");
}

void print_times(Entries& entries, Samples& samples, const Settings& settings, int passes) {
  std::vector<double> phi;
  std::vector<Sample> prepared;
  const std::size_t n = samples.parameters();
  phi.reserve(n * samples.size());
  for (std::size_t k = samples.first(); k < samples.size(); ++k) {
    Sample sample = samples.at(k);
    phi.insert(phi.end(), sample.phi, sample.phi + n);
    sample.phi = phi.data() + phi.size() - n;
    prepared.push_back(sample);
  }
  for (Entry& entry : entries) {
    entry.peer->prepare(prepared);
  }
  std::vector<std::vector<double>> times(entries.size());
  for (int pass = -1; pass < passes; ++pass) {  // the first warms the caches
    for (std::size_t i = 0; i < entries.size(); ++i) {
      entries[i].peer->start(settings);
      const auto begin = std::chrono::steady_clock::now();
      entries[i].peer->pass();
      const std::chrono::duration<double, std::nano> taken =
          std::chrono::steady_clock::now() - begin;
      if (pass >= 0) {
        times[i].push_back(taken.count() / static_cast<double>(prepared.size()));
      }
    }
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    open_line(entries[i], entries[i].peer->start(settings));
    std::printf(", \"ns\": ");
    print_list(times[i]);
    std::printf("}\n");
  }
}

/// How long the parameters stay where they are and finite once the samples tell nothing.
void print_hold(Entry& entry, Samples& samples, const Settings& settings, std::size_t excited) {
  open_line(entry, entry.peer->start(settings));
  const std::size_t n = samples.parameters();
  std::vector<double> before(n);
  std::vector<double> theta(n);
  double largest = 0.0;
  long moved = -1;
  long not_finite = -1;
  for (std::size_t k = 0; k < samples.size() && not_finite < 0; ++k) {
    feed(entry, samples, k);
    if (k + 1 < excited) {
      continue;
    }
    entry.peer->theta(theta.data());
    if (k + 1 == excited) {
      before = theta;
      for (const double value : theta) {
        largest = std::fmax(largest, std::fabs(value));
      }
    }
    const long held = static_cast<long>(k + 1 - excited);
    for (std::size_t i = 0; i < n; ++i) {
      if (!std::isfinite(theta[i])) {
        not_finite = held;
      }
      if (moved < 0 && !(std::fabs(theta[i] - before[i]) <= kMoved * largest)) {
        moved = held;
      }
    }
  }
  std::printf(", \"moved\": %ld, \"not_finite\": %ld, \"held\": %zu}\n", moved, not_finite,
              samples.size() - excited);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 8) {
    std::fprintf(stderr, "usage: peers theta|time|hold FILE NA NB LAMBDA VARIANCE0 NUMBER...\n");
    return 2;
  }
  const std::string mode = arguments[1];
  const int na = std::atoi(arguments[3]);
  const int nb = std::atoi(arguments[4]);
  Samples samples(arguments[2], na, nb);
  const Settings settings{std::atof(arguments[5]), std::atof(arguments[6])};
  std::vector<std::size_t> numbers;
  for (int i = 7; i < count; ++i) {
    numbers.push_back(static_cast<std::size_t>(std::atoll(arguments[i])));
  }
  Entries entries = entries_for(na + nb);
  if (mode == "time") {
    print_times(entries, samples, settings, static_cast<int>(numbers[0]));
    return 0;
  }
  for (Entry& entry : entries) {
    if (mode == "theta") {
      print_theta(entry, samples, settings, numbers);
    } else {
      print_hold(entry, samples, settings, numbers[0]);
    }
  }
  return 0;
}
