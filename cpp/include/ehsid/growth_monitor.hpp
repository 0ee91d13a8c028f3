// SPDX-License-Identifier: MIT
// Which of a few effects grows: dead band, friction, leakage, null bias. A linear servo with a fixed observer predicts each
// position, and the mean of the innovations in each cell of command and acceleration tells the effects apart. Tables made
// offline (`ehsid export --growth`) hold that mean for the machine of today and its change by each effect of unit size.
//
// With x the normalised innovation less its mean, and s the signatures of its cell in deviations, a block adds up b = sum x s and
// A = sum s s'. Each test adds up the blocks since it began, which is a Gaussian likelihood. What changes with the oil, too, has
// a wide Gaussian prior and is eliminated (Schur complement b~, A~). Of the tested effect,
//   S = ((1 - m) b~ - (1 - m^2) A~ / 2) / phi
// is the logarithm of the likelihood ratio of size 1 against size m, which the quiet record leaves open. CUSUM (E. Page,
// "Continuous inspection schemes", Biometrika 41, 1954): a test begins anew where S <= 0 and gives an alarm where S > limit. Of
// independent blocks the mean distance of false alarms is then exp(limit) blocks or more for each test (G. Lorden, "Procedures
// for reacting to a change in distribution", Ann. Math. Stat. 42, 1971). phi, the variance of a block's score over A~, is that
// of a quiet record and allows for innovations that are not white.
//
// The effect that is named explains most alone since the test of the first alarm began, b~^2 / (2 A~ phi), with a lead of
// kLead and of a share of it. An effect may have signatures of several sizes, because cells change with the size, too. What was measured:
// docs/growth.md.
#pragma once

#include <ehsid/growth_tables.hpp>
#include <ehsid/types.hpp>

#include <array>
#include <cmath>

namespace ehsid {

/// Sums of a signature. Plain data.
template <class Scalar>
struct GrowthRow {
  Scalar score;                       // b
  Scalar information;                 // A_nn
  Array<Scalar, kGrowthOthers> with;  // A_n0, A_n1 with what is eliminated

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthRow::score);
    visit(&GrowthRow::information);
    visit(&GrowthRow::with);
  }
};

/// b and what is needed of A. Plain data.
template <class Scalar, int kSignatures>
struct GrowthSums {
  Array<GrowthRow<Scalar>, kGrowthOthers> others;
  Array<GrowthRow<Scalar>, kSignatures> rows;

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthSums::others);
    visit(&GrowthSums::rows);
  }
};

/// Sums of a block by cells. Plain data.
template <class Scalar>
struct GrowthBlock {
  std::array<Scalar, kGrowthCells> sum;    // of x
  std::array<Scalar, kGrowthCells> count;  // of samples

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthBlock::sum);
    visit(&GrowthBlock::count);
  }
};

/// What a test remembers. Plain data.
template <class Scalar, int kSignatures>
struct GrowthTestState {
  GrowthSums<Scalar, kSignatures> sums;
  Scalar statistic;      // S
  Scalar size;           // estimate, in unit sizes
  Scalar information;    // A~
  std::int32_t blocks;   // since the test began
  std::uint8_t alarmed;  // 1 from an alarm to restart()

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthTestState::sums);
    visit(&GrowthTestState::statistic);
    visit(&GrowthTestState::size);
    visit(&GrowthTestState::information);
    visit(&GrowthTestState::blocks);
    visit(&GrowthTestState::alarmed);
  }
};

/// How far the work behind a block is. Plain data.
template <class Scalar>
struct GrowthWork {
  std::int32_t row;     // whose sums over cells are formed; behind the last one the tests follow
  std::int32_t cell;    // next one of this row
  std::int32_t test;    // as many as there are where none is
  std::int32_t column;  // 0: what is eliminated; then the signatures
  std::int32_t best;    // effect that explains most
  Scalar most;          // what it explains
  Scalar second;        // what the next one explains
  Scalar share;         // A_01 / A_00 of what is eliminated
  std::array<Scalar, kGrowthOthers> inverse;  // 1 / pivot
  std::array<Scalar, kGrowthOthers> score;    // the first one is taken out of the second one

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthWork::row);
    visit(&GrowthWork::cell);
    visit(&GrowthWork::test);
    visit(&GrowthWork::column);
    visit(&GrowthWork::best);
    visit(&GrowthWork::most);
    visit(&GrowthWork::second);
    visit(&GrowthWork::share);
    visit(&GrowthWork::inverse);
    visit(&GrowthWork::score);
  }
};

/// What a GrowthMonitor remembers. Plain data.
template <class Scalar, int kSignatures, int kTests>
struct GrowthState {
  std::array<Scalar, kGrowthMostDelay> commands;  // newest first
  Scalar position;                                // of the last sample
  Scalar innovation;                              // of the last sample
  Scalar velocity;                                // a sample, of the observer
  Scalar acceleration;                            // a sample^2
  Scalar model_velocity;                          // of the model on the commands alone
  Scalar model_acceleration;
  std::array<GrowthBlock<Scalar>, 2>
      blocks;                            // of this one and of the one before, cleared when used
  GrowthSums<Scalar, kSignatures> sums;  // of the block before, as far as they are formed
  GrowthWork<Scalar> work;
  Array<GrowthTestState<Scalar, kSignatures>, kTests> tests;
  std::int32_t counted;  // samples in this block
  std::int32_t side;     // place of this block
  std::int32_t settled;  // samples since the start or a refused one, up to `settle`
  std::int32_t first;    // 1 + the test of the first alarm; 0: none
  std::int32_t named;    // 1 + the test of the effect that explains it; 0: none
  std::int32_t cell;     // of the last sample
  std::uint8_t started;  // a sample is before the next one

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&GrowthState::commands);
    visit(&GrowthState::position);
    visit(&GrowthState::innovation);
    visit(&GrowthState::velocity);
    visit(&GrowthState::acceleration);
    visit(&GrowthState::model_velocity);
    visit(&GrowthState::model_acceleration);
    visit(&GrowthState::blocks);

    visit(&GrowthState::sums);
    visit(&GrowthState::work);
    visit(&GrowthState::tests);
    visit(&GrowthState::counted);
    visit(&GrowthState::side);
    visit(&GrowthState::settled);
    visit(&GrowthState::first);
    visit(&GrowthState::named);
    visit(&GrowthState::cell);
    visit(&GrowthState::started);
  }
};

/// What a test tells.
template <class Scalar>
struct Growth {
  bool alarmed;
  Scalar statistic;     // S; above the limit there is an alarm
  Scalar size;          // growth in unit sizes since it began, in the direction of the test
  Scalar deviation;     // of the size; 0 where nothing is known
  std::int32_t blocks;  // ago it began: blocks of `block` samples
};

/// Runs beside an estimator. Static memory, no heap; every sample takes about the same time: what follows a block is done
/// step by step during the next one. Sizes may be up_to(most).
template <class Scalar_, int kSignatures, int kTests>
class GrowthMonitor {
 public:
  using Scalar = Scalar_;
  using Tables = GrowthTables<Scalar, kSignatures, kTests>;
  using State = GrowthState<Scalar, kSignatures, kTests>;
  using Sums = GrowthSums<Scalar, kSignatures>;

  /// A command or position beyond this is refused.
  static constexpr Scalar kLargest = Scalar(1e12);
  /// An innovation counts up to this many deviations.
  static constexpr Scalar kLimit = Scalar(4);
  /// Lead of the effect that is named over the next one, logarithm of a likelihood ratio.
  static constexpr Scalar kLead = Scalar(6);
  /// The same as a share of what it explains, because signatures are not exact.
  static constexpr Scalar kLeadShare = Scalar(0.03);
  /// A test keeps what it has behind so many blocks, where a float no longer adds up; without an alarm it begins anew.
  static constexpr std::int32_t kMostBlocks = 1 << 20;

  /// Takes the tables, which must outlive the monitor, and starts anew. invalid_argument leaves everything as it was.
  EHSID_RARE Status configure(const Tables& tables) {
    if (!tables.valid()) {
      return Status::invalid_argument;
    }
    tables_ = &tables;
    restart();
    return Status::ok;
  }

  /// Begins anew, e.g. behind a repair: forgets alarms and sums.
  EHSID_RARE void restart() {
    state_ = State{};
    state_.work.test = tests();
  }

  /// One sample: the command sent at t_k and the position measured at t_k.
  ///
  /// ok; filling while the observer settles; invalid_argument before configure(); invalid_input, out_of_range or
  /// numerical_limit, where nothing is added to a sum and the next good sample is taken as the first behind a hole.
  Status step(Scalar command, Scalar position) {
    if (tables_ == nullptr) {
      return Status::invalid_argument;
    }
    if (!is_finite(command) || !is_finite(position)) {
      state_.started = 0;
      return Status::invalid_input;
    }
    if (!(std::abs(command) <= kLargest && std::abs(position) <= kLargest)) {
      state_.started = 0;
      return Status::out_of_range;
    }
    if (state_.started == 0) {
      begin(command, position);
      return Status::filling;
    }
    const Tables& t = *tables_;
    const Scalar demand = t.gain * state_.commands[static_cast<std::size_t>(t.delay - 1)];
    const Scalar error = state_.velocity - demand;
    const Scalar a = state_.acceleration;
    // The estimate of the position was (1 - correction) innovations behind the measured one.
    const Scalar moved = state_.velocity - t.s * error + t.i * a;
    const Scalar innovation =
        (position - state_.position) - ((t.correction[0] - Scalar(1)) * state_.innovation + moved);
    if (!is_squarable(innovation)) {
      state_.started = 0;
      return Status::numerical_limit;
    }
    state_.velocity = (state_.velocity + t.e * a - t.w * error) + t.correction[1] * innovation;
    state_.acceleration = (t.decay * a - t.pull * error) + t.correction[2] * innovation;
    const Scalar model_error = state_.model_velocity - demand;
    const Scalar model_a = state_.model_acceleration;
    state_.model_velocity = state_.model_velocity + t.e * model_a - t.w * model_error;
    state_.model_acceleration = t.decay * model_a - t.pull * model_error;
    state_.innovation = innovation;
    state_.position = position;
    const int cell =
        place(t.command_edges, state_.commands[static_cast<std::size_t>(t.delay - 1)]) *
            kGrowthAccelerations +
        place(t.acceleration_edges, state_.model_acceleration);
    state_.cell = cell;
    for (std::size_t n = static_cast<std::size_t>(t.delay - 1); n > 0; --n) {
      state_.commands[n] = state_.commands[n - 1];
    }
    state_.commands[0] = command;
    Status status = Status::ok;
    if (state_.settled < t.settle) {
      ++state_.settled;
      status = Status::filling;
    } else {
      add(t.cells[static_cast<std::size_t>(cell)], innovation);
    }
    work();
    return status;
  }

  /// What test n of the tables tells, 0 <= n < tests.
  Growth<Scalar> told(int n) const {
    const auto& test = state_.tests[static_cast<std::size_t>(n)];
    const Scalar trust = tables_->asked[static_cast<std::size_t>(n)].trust;
    const Scalar known = test.information * trust;
    const Scalar deviation = known > Scalar(0) ? Scalar(1) / std::sqrt(known) : Scalar(0);
    return {test.alarmed != 0, test.statistic, test.size, deviation, test.blocks};
  }

  /// The test that gave the first alarm since the start, -1: none.
  std::int32_t first() const { return state_.first - 1; }
  /// The test whose effect explains the first alarm, -1: none, or the effects cannot be told apart yet.
  std::int32_t named() const { return state_.named - 1; }

  const Tables* tables() const { return tables_; }
  const State& state() const { return state_; }

  /// May this saved state be taken over by a monitor with the same tables?
  bool usable(const State& saved) const {
    if (tables_ == nullptr) {
      return false;
    }
    const GrowthWork<Scalar>& work = saved.work;
    bool good = all_squarable(kGrowthMostDelay, saved.commands) && is_squarable(saved.position) &&
                is_squarable(saved.innovation) && is_squarable(saved.velocity) &&
                is_squarable(saved.acceleration) && is_squarable(saved.model_velocity) &&
                is_squarable(saved.model_acceleration) && usable(saved.blocks[0]) &&
                usable(saved.blocks[1]) && usable(saved.sums) && within(saved.side, 2) &&
                is_squarable(work.most) && is_squarable(work.second) && is_squarable(work.share) &&
                all_squarable(kGrowthOthers, work.inverse) &&
                all_squarable(kGrowthOthers, work.score) && within(work.test, tests() + 1) &&
                within(work.row, rows() + 1) && within(work.cell, kGrowthCells) &&
                work.cell % kGrowthGroup == 0 && within(work.column, signatures() + 1) &&
                within(work.best, tests()) && within(saved.counted, tables_->block) &&
                within(saved.settled, tables_->settle + 1) && within(saved.first, tests() + 1) &&
                within(saved.named, tests() + 1) && within(saved.cell, kGrowthCells) &&
                saved.started <= 1;
    for (const auto& test : saved.tests) {
      good = good && usable(test.sums) && is_squarable(test.statistic) && is_squarable(test.size) &&
             is_variance(test.information) && within(test.blocks, kMostBlocks + 1) &&
             test.alarmed <= 1;
    }
    return good;
  }

  /// Takes a saved state over; invalid_argument, and nothing changed, unless it is usable.
  Status restore(const State& saved) {
    if (!usable(saved)) {
      return Status::invalid_argument;
    }
    state_ = saved;
    return Status::ok;
  }

 private:
  int signatures() const {
    if constexpr (kSignatures > 0) {
      return kSignatures;
    } else {
      return tables_->signatures;
    }
  }
  int tests() const {
    if constexpr (kTests > 0) {
      return kTests;
    } else {
      return tables_->tests;
    }
  }

  /// Rows of sums: of what is eliminated, and of the signatures.
  int rows() const { return kGrowthOthers + signatures(); }

  static bool within(std::int32_t number, std::int32_t end) { return number >= 0 && number < end; }
  static bool usable(const Sums& sums) {
    bool good = true;
    for (const auto& row : sums.others) {
      good = usable(row) && good;
    }
    for (const auto& row : sums.rows) {
      good = usable(row) && good;
    }
    return good;
  }
  static bool usable(const GrowthBlock<Scalar>& block) {
    bool good = all_squarable(kGrowthCells, block.sum);
    for (const Scalar count : block.count) {
      good = is_variance(count) && good;
    }
    return good;
  }
  static bool usable(const GrowthRow<Scalar>& row) {
    return is_squarable(row.score) && is_variance(row.information) &&
           all_squarable(kGrowthOthers, row.with);
  }

  /// The first sample, or the first behind a hole.
  EHSID_RARE void begin(Scalar command, Scalar position) {
    state_.commands.fill(command);
    state_.position = position;
    state_.innovation = state_.velocity = state_.acceleration = Scalar(0);
    state_.model_velocity = state_.model_acceleration = Scalar(0);
    state_.settled = 0;
    state_.started = 1;
  }

  /// How many edges lie below a value. Not a search: a branch that depends on noise is guessed wrong.
  template <class Edges>
  static int place(const Edges& edges, Scalar value) {
    int found = 0;
    EHSID_UNROLL
    for (const Scalar edge : edges) {
      found += value > edge ? 1 : 0;
    }
    return found;
  }

  /// An innovation joins the sums of the block, and closes it where it is the last.
  void add(const GrowthCell<Scalar, kSignatures>& cell, Scalar innovation) {
    const Scalar x = (innovation - cell.mean) * cell.weight;
    const Scalar limited = x > kLimit ? kLimit : (x < -kLimit ? -kLimit : x);
    GrowthBlock<Scalar>& block = state_.blocks[static_cast<std::size_t>(state_.side)];
    block.sum[static_cast<std::size_t>(state_.cell)] += limited;
    block.count[static_cast<std::size_t>(state_.cell)] += Scalar(1);
    if (++state_.counted == tables_->block) {
      state_.counted = 0;
      state_.side = 1 - state_.side;
      state_.work = {};
    }
  }

  /// One step of what follows a block.
  void work() {
    GrowthWork<Scalar>& work = state_.work;
    if (work.test >= tests()) {
      return;
    }
    if (work.row < rows()) {
      sum_up();
      return;
    }
    auto& test = state_.tests[static_cast<std::size_t>(work.test)];
    if (work.column == 0) {
      open(test);
    } else {
      weigh(test, work.column - 1);
    }
    if (++work.column > signatures()) {
      judge(test);
      work.column = 0;
      ++work.test;
    }
  }

  /// Adds a group of cells to the sums of a row.
  EHSID_ONCE void sum_up() {
    GrowthWork<Scalar>& work = state_.work;
    const bool eliminated = work.row < kGrowthOthers;
    const auto n = static_cast<std::size_t>(eliminated ? work.row : work.row - kGrowthOthers);
    GrowthRow<Scalar>& kept = eliminated ? state_.sums.others[n] : state_.sums.rows[n];
    GrowthRow<Scalar> row = work.cell == 0 ? GrowthRow<Scalar>{} : kept;
    GrowthBlock<Scalar>& block = state_.blocks[static_cast<std::size_t>(1 - state_.side)];
    const bool last = work.row == rows() - 1;
    const auto first = static_cast<std::size_t>(work.cell);
    for (std::size_t c = first; c < first + kGrowthGroup; ++c) {
      const auto& cell = tables_->cells[c];
      const Scalar s = eliminated ? cell.other[n] : cell.signature[n];
      const Scalar counted = s * block.count[c];
      row.score += s * block.sum[c];
      row.information += s * counted;
      row.with[0] += cell.other[0] * counted;
      row.with[1] += cell.other[1] * counted;
      if (last) {
        block.sum[c] = block.count[c] = Scalar(0);
      }
    }
    kept = row;
    work.cell += kGrowthGroup;
    if (work.cell == kGrowthCells) {
      work.cell = 0;
      ++work.row;
    }
  }

  /// Adds a row of the block to that of the test, which may begin with it, or be full and keep what it has.
  static void gather(GrowthRow<Scalar>& to, const GrowthRow<Scalar>& from, std::int32_t blocks) {
    if (blocks == 0) {
      to = from;
    } else if (blocks < kMostBlocks) {
      to.score += from.score;
      to.information += from.information;
      to.with[0] += from.with[0];
      to.with[1] += from.with[1];
    }
  }

  EHSID_ONCE void open(GrowthTestState<Scalar, kSignatures>& test) {
    GrowthWork<Scalar>& work = state_.work;
    if (test.blocks >= kMostBlocks && test.alarmed == 0) {
      test.blocks = 0;
    }
    gather(test.sums.others[0], state_.sums.others[0], test.blocks);
    gather(test.sums.others[1], state_.sums.others[1], test.blocks);
    const auto& others = test.sums.others;
    const Scalar both = others[1].with[0];
    work.inverse[0] = Scalar(1) / (others[0].information + tables_->prior);
    work.share = both * work.inverse[0];
    work.inverse[1] = Scalar(1) / ((others[1].information - work.share * both) + tables_->prior);
    work.score[0] = others[0].score;
    work.score[1] = others[1].score - work.share * work.score[0];
    work.best = 0;
    work.most = work.second = Scalar(0);
  }

  /// What signature n explains.
  EHSID_ONCE void weigh(GrowthTestState<Scalar, kSignatures>& test, int n) {
    GrowthWork<Scalar>& work = state_.work;
    auto& row = test.sums.rows[static_cast<std::size_t>(n)];
    gather(row, state_.sums.rows[static_cast<std::size_t>(n)], test.blocks);
    const Scalar first = row.with[0] * work.inverse[0];
    const Scalar rest = row.with[1] - work.share * row.with[0];
    const Scalar second = rest * work.inverse[1];
    const Scalar score = row.score - first * work.score[0] - second * work.score[1];
    const Scalar left = row.information - first * row.with[0] - second * rest;
    const Scalar information = left > Scalar(0) ? left : Scalar(0);  // below 0 by rounding
    const Scalar size = information > Scalar(0) ? score / information : Scalar(0);
    const Scalar explained = size > Scalar(0) ? Scalar(0.5) * score * size : Scalar(0);
    const std::int32_t effect = tables_->effect[static_cast<std::size_t>(n)];
    if (explained > work.most) {
      work.second = effect == work.best ? work.second : work.most;
      work.most = explained;
      work.best = effect;
    } else if (effect != work.best && explained > work.second) {
      work.second = explained;
    }
    const GrowthTest<Scalar>& asked = tables_->asked[static_cast<std::size_t>(work.test)];
    if (n == asked.signature) {
      const Scalar growth = score - Scalar(0.5) * (Scalar(1) + asked.margin) * information;
      test.statistic = asked.trust * (Scalar(1) - asked.margin) * growth;
      test.size = size;
      test.information = information;
    }
  }

  void judge(GrowthTestState<Scalar, kSignatures>& test) {
    const GrowthWork<Scalar>& work = state_.work;
    test.blocks += test.blocks < kMostBlocks ? 1 : 0;
    if (test.alarmed == 0 && !(test.statistic > Scalar(0))) {
      test.statistic = test.size = test.information = Scalar(0);
      test.blocks = 0;  // its sums begin with the next block
      return;
    }
    if (test.alarmed == 0 && test.statistic > tables_->limit) {
      test.alarmed = 1;
      state_.first = state_.first == 0 ? work.test + 1 : state_.first;
    }
    const Scalar trust = tables_->asked[static_cast<std::size_t>(work.test)].trust;
    if (state_.first == work.test + 1 && state_.named == 0 &&
        trust * (work.most - work.second) > kLead &&
        work.most - work.second > kLeadShare * work.most) {
      state_.named = work.best + 1;
    }
  }

  const Tables* tables_ = nullptr;
  State state_{};
};

}  // namespace ehsid
