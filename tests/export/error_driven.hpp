// Written by `ehsid export`, ehsid 0.2.0; do not edit, export again.
// Settings and start of the online estimator, and a self-test for the target. Numbers are float32 in
// hexadecimal, exact to the bit; decimals are for people.
//
// Record hydraulic_crane.csv, sha256
// 3fd24a1fe2d09e4635d068aea802cae4bebe600b7691387647fca79c80c9b4ba
// Made by tests/export/make_headers.py
//
// Results are bit for bit those of Python where the compiler does not fuse multiplications and additions
// (-ffp-contract=off, as the CMake target ehsid::reproducible sets it), nor uses -ffast-math.
// clang-format off
#pragma once

#include <cstdint>
#include <cstring>
#include <ehsid/ehsid.hpp>

namespace error_driven {

/// na = 4, nb = 2, nk = 1.
using Estimator =
    ehsid::ArxEstimator<float, 4, 2, 1, ehsid::ErrorDriven<float>>;

/// Sampling time of the record, s; the parameters hold for no other.
inline constexpr float kDtS = 0x1.99999ap-5F;  // 0.05

/// theta_0, in the units of the signals about the offsets of the scaling.
inline constexpr ehsid::Array<float, Estimator::kN> kTheta0 = {{
    -0x1.9374bcp+0F,  // a1 = -1.576
    0x1.e7d566p-2F,  // a2 = 0.4764
    0x1.eac86p-5F,  // a3 = 0.05991
    0x1.afb7eap-4F,  // a4 = 0.1054
    -0x1.37dbf4p-1F,  // b1 = -0.6091
    0x1.fe76c8p-2F,  // b2 = 0.4985
}};

/// P_0 = U D U' of the scaled parameters in units of sigma^2: D, then the columns of U above its diagonal.
inline constexpr ehsid::UdFactors<float, Estimator::kN> kFactors0 = {
    {{
        0x1.4794eap-7F,  // 0.009997
        0x1.fced92p-2F,  // 0.497
        0x1.d89374p+0F,  // 1.846
        0x1.df7ceep+0F,  // 1.873
        0x1.1f9f02p-5F,  // 0.03511
        0x1.3b645ap+2F,  // 4.928
    }},
    {{
        -0x1.f9e83ep-1F,  // -0.9881
        0x1.b4e3bcp-1F,  // 0.8533
        -0x1.d58106p+0F,  // -1.834
        0x1.e2824p-4F,  // 0.1178
        0x1.4617c2p-1F,  // 0.6369
        -0x1.bba5e4p+0F,  // -1.733
        -0x1.756042p+1F,  // -2.917
        0x1.35c29p+1F,  // 2.42
        0x1.326e98p+1F,  // 2.394
        -0x1.674bc6p+1F,  // -2.807
        0x1.1bcfd4p-4F,  // 0.06929
        -0x1.3443d4p-4F,  // -0.07526
        0x1.22fad6p-6F,  // 0.01776
        -0x1.06cca2p-6F,  // -0.01604
        -0x1.fd566cp-1F,  // -0.9948
    }},
};

/// sigma^2 of the offline model, squared units of the position.
inline constexpr float kNoiseVariance = 0x1.55714cp-7F;  // 0.01042

/// Sets the estimator up and starts it from the offline model; ok, unless this file was changed.
inline ehsid::Status configure(Estimator& estimator) {
  Estimator::Options options;
  options.scaling.command_scale = 0x1.60d1b8p-1F;  // 0.6891
  options.scaling.position_scale = 0x1.845a1cp+0F;  // 1.517
  options.scaling.command_offset = -0x1.875f7p-3F;  // -0.1911
  options.scaling.position_offset = 0x1.7b634ep-8F;  // 0.005789
  options.forgetting.memory = 0x1.4p+6F;  // 80
  options.forgetting.lambda_min = 0x1.333334p-1F;  // 0.6
  options.forgetting.noise_variance = 0x0p+0F;  // 0
  options.rls.information_margin = 0x1.8p+0F;  // 1.5
  options.rls.covariance_ceiling = 0x1p+1F;  // 2
  options.reset.short_window = 0x1.4p+2F;  // 5
  options.reset.long_window = 0x1.ep+5F;  // 60
  options.reset.trigger_ratio = 0x1p+1F;  // 2
  options.reset.release_ratio = 0x1.8p+0F;  // 1.5
  options.reset.cool_down = 50;
  options.reset.floor = 0x1.4f8b58p-17F;  // 1e-05
  options.convergence.tolerance = 0x1.99999ap-4F;  // 0.1
  options.convergence.magnitude = 0x1.99999ap-4F;  // 0.1
  options.convergence.hold = 10;
  options.variance0 = Estimator::Parameters::Constant(Estimator::kN, 0x1.e848p+19F);  // 1e+06
  options.input_limit = 0x1.f4p+9F;  // 1000
  const ehsid::Status status = estimator.configure(options);
  if (status != ehsid::Status::ok) {
    return status;
  }
  return estimator.seed(ehsid::to_vector<Estimator::kN>(Estimator::kN, kTheta0), kFactors0, kNoiseVariance);
}

/// A sample of the golden trace: command and position in their units, and the innovation after it.
struct TraceSample {
  float command;
  float position;
  float innovation;
};

inline constexpr ehsid::Array<TraceSample, 16> kTrace = {{
    {0x1.ae429ep-1F, -0x1.8e9332p+1F, 0x0p+0F},
    {0x1.77429ap-1F, -0x1.8f540ap+1F, 0x0p+0F},
    {0x1.37829p-1F, -0x1.926558p+1F, 0x0p+0F},
    {0x1.f20536p-2F, -0x1.9500a6p+1F, 0x0p+0F},
    {0x1.7c853cp-2F, -0x1.971f36p+1F, -0x1.8b85aep-3F},
    {0x1.13854p-2F, -0x1.8dd0bap+1F, -0x1.46e51cp-4F},
    {0x1.5f0a1cp-3F, -0x1.0d773cp+1F, 0x1.98de4p-1F},
    {0x1.921484p-4F, -0x1.98ed52p-1F, 0x0p+0F},
    {0x1.9428e2p-5F, 0x1.7cd926p-3F, -0x1.c115ccp-3F},
    {0x1.a0a37ap-7F, 0x1.52d2bcp+0F, 0x1.770056p-2F},
    {-0x1.cf5bf4p-7F, 0x1.13b7f6p+1F, -0x1.547p-1F},
    {-0x1.b3d6fcp-5F, 0x1.6231dp+1F, 0x1.8bfa58p-2F},
    {-0x1.51eb86p-4F, 0x1.b5eacap+1F, 0x1.69a11ap-2F},
    {-0x1.79eb7ep-4F, 0x1.c239cp+1F, -0x1.1ced88p-3F},
    {-0x1.79eb7ep-4F, 0x1.bc0ddap+1F, -0x1.8f42fap+0F},
    {-0x1.79eb7ep-4F, 0x1.b30f34p+1F, 0x1.22096p-2F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.d37098p-2F,  // -0.456484
    -0x1.06edbp-1F,  // -0.513532
    -0x1.9f0f4ap-2F,  // -0.405332
    0x1.1ce5cp-1F,  // 0.55644
    -0x1.04015cp+3F,  // -8.12517
    0x1.3187b6p+3F,  // 9.54782
}};

inline bool same_bits(float left, float right) {
  std::uint32_t left_bits = 0;
  std::uint32_t right_bits = 0;
  std::memcpy(&left_bits, &left, sizeof left);
  std::memcpy(&right_bits, &right, sizeof right);
  return left_bits == right_bits;
}

/// Runs the trace through an estimator of its own, sizeof(Estimator) bytes on the stack. True where every
/// innovation and the last theta_hat are, bit for bit, those that Python computed.
inline bool self_test() {
  Estimator estimator;
  bool same = configure(estimator) == ehsid::Status::ok;
  for (const TraceSample& sample : kTrace) {
    same = !ehsid::is_error(estimator.step(sample.command, sample.position)) &&
           same_bits(estimator.innovation(), sample.innovation) && same;
  }
  const Estimator::Parameters theta = estimator.theta_hat();
  for (int i = 0; i < Estimator::kN; ++i) {
    same = same_bits(theta[i], ehsid::entry(kTraceTheta, i)) && same;
  }
  return same;
}

}  // namespace error_driven
