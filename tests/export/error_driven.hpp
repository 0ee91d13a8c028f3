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

inline constexpr ehsid::Array<TraceSample, 64> kTrace = {{
    {-0x1.a27d68p-1F, 0x1.cc72c4p+0F, 0x0p+0F},
    {-0x1.e0fd7ep-1F, 0x1.1a8cf2p+1F, 0x0p+0F},
    {-0x1.0c9eecp+0F, 0x1.2d7688p+1F, 0x0p+0F},
    {-0x1.245eb4p+0F, 0x1.372c68p+1F, 0x0p+0F},
    {-0x1.321ea4p+0F, 0x1.3932aep+1F, -0x1.7aa024p-4F},
    {-0x1.3c1e7ap+0F, 0x1.2cd974p+1F, -0x1.afc926p-4F},
    {-0x1.411e64p+0F, 0x1.147c46p+1F, -0x1.bfbf92p-4F},
    {-0x1.475ec8p+0F, 0x1.ed5158p+0F, -0x1.1ad78cp-4F},
    {-0x1.4a7efap+0F, 0x1.aac9d6p+0F, -0x1.e73638p-5F},
    {-0x1.4b1ee2p+0F, 0x1.5e4276p+0F, -0x1.3fed2p-4F},
    {-0x1.4b1ee2p+0F, 0x1.3ebb08p+0F, 0x1.e33d74p-4F},
    {-0x1.4b1ee2p+0F, 0x1.01d402p+0F, -0x1.e16d1p-4F},
    {-0x1.4a7efap+0F, 0x1.844a8p-1F, -0x1.7cc594p-4F},
    {-0x1.4a7efap+0F, 0x1.1015eep-1F, -0x1.1b0b38p-4F},
    {-0x1.439eaep+0F, 0x1.7893b2p-2F, -0x1.5241c6p-6F},
    {-0x1.38fefp+0F, 0x1.06c95ap-2F, -0x1.89cab8p-7F},
    {-0x1.2efe72p+0F, 0x1.a9646ep-3F, 0x1.0ba534p-8F},
    {-0x1.1f5ec8p+0F, 0x1.8dcc78p-3F, -0x1.16303ap-6F},
    {-0x1.05beap+0F, 0x1.e29d2p-3F, 0x1.80f2f8p-7F},
    {-0x1.c7fd6p-1F, 0x1.4c6c2ep-2F, 0x1.1ecdfep-5F},
    {-0x1.7bbd7cp-1F, 0x1.d0d458p-2F, 0x1.c049b6p-5F},
    {-0x1.2f7d74p-1F, 0x1.2d1f32p-1F, 0x1.3f409p-5F},
    {-0x1.c3faf4p-2F, 0x1.80390ap-1F, 0x1.1fcc3p-4F},
    {-0x1.32fad6p-2F, 0x1.dd5418p-1F, 0x1.55505ap-4F},
    {-0x1.52f5dcp-3F, 0x1.291172p+0F, 0x1.014e9ap-3F},
    {-0x1.63d70ap-5F, 0x1.0c9e34p+0F, -0x1.e5452ap-3F},
    {0x1.4c1476p-4F, 0x1.c9f9f6p-1F, -0x1.2f7b12p-5F},
    {0x1.910a14p-3F, 0x1.f1c8c8p-2F, -0x1.95ec2ep-3F},
    {0x1.39053ap-2F, -0x1.6a0228p-7F, -0x1.3f9a62p-4F},
    {0x1.9d052ap-2F, -0x1.37840cp-3F, 0x1.83f894p-2F},
    {0x1.f98528p-2F, -0x1.b9baf2p-2F, -0x1.805596p-8F},
    {0x1.24c294p-1F, -0x1.ae1ab8p-1F, -0x1.9d498cp-4F},
    {0x1.468294p-1F, -0x1.357d72p+0F, -0x1.539534p-8F},
    {0x1.65c29p-1F, -0x1.bf34bap+0F, -0x1.7e8882p-3F},
    {0x1.7b0292p-1F, -0x1.2180ep+1F, -0x1.e9b664p-5F},
    {0x1.8c829cp-1F, -0x1.451c16p+1F, 0x1.342b1cp-3F},
    {0x1.9a428ep-1F, -0x1.95a2e2p+1F, -0x1.7b963ap-2F},
    {0x1.a30292p-1F, -0x1.b2618cp+1F, 0x1.965758p-3F},
    {0x1.abc298p-1F, -0x1.ca4b4ep+1F, 0x1.c06a6cp-9F},
    {0x1.b5c29p-1F, -0x1.e74358p+1F, -0x1.e846e6p-4F},
    {0x1.c3828p-1F, -0x1.f41346p+1F, -0x1.a679cp-5F},
    {0x1.d14292p-1F, -0x1.fb700ap+1F, -0x1.2c450ap-4F},
    {0x1.e04296p-1F, -0x1.f978f4p+1F, -0x1.47c694p-5F},
    {0x1.ef429ap-1F, -0x1.e7ff6cp+1F, 0x1.1c9a7ap-6F},
    {0x1.ff829p-1F, -0x1.e0af2ep+1F, -0x1.2173f2p-3F},
    {0x1.08811cp+0F, -0x1.cc0acp+1F, -0x1.f1ca1p-7F},
    {0x1.11e108p+0F, -0x1.b38b4cp+1F, -0x1.bbe678p-6F},
    {0x1.1dc14p+0F, -0x1.8fb27ap+1F, 0x1.c1af1p-5F},
    {0x1.27212ep+0F, -0x1.7e266p+1F, -0x1.19bf3p-3F},
    {0x1.312104p+0F, -0x1.627f62p+1F, 0x1.9c2aeep-7F},
    {0x1.3c6152p+0F, -0x1.53312p+1F, -0x1.653c28p-4F},
    {0x1.42a10ep+0F, -0x1.425202p+1F, -0x1.9bdd9p-13F},
    {0x1.47a0fap+0F, -0x1.37f9c6p+1F, -0x1.47fb4cp-5F},
    {0x1.48e172p+0F, -0x1.2713a2p+1F, 0x1.d61aa4p-5F},
    {0x1.48e172p+0F, -0x1.216002p+1F, -0x1.690b04p-5F},
    {0x1.48e172p+0F, -0x1.22fa5cp+1F, -0x1.d6aeeep-5F},
    {0x1.48418ap+0F, -0x1.29252cp+1F, -0x1.7b2ap-5F},
    {0x1.466128p+0F, -0x1.32c0e4p+1F, -0x1.e0c9cap-6F},
    {0x1.44817p+0F, -0x1.3de15ap+1F, -0x1.06f29ap-6F},
    {0x1.4340f6p+0F, -0x1.4876d6p+1F, 0x1.06405ap-12F},
    {0x1.40c154p+0F, -0x1.56628ep+1F, -0x1.b5da5ep-6F},
    {0x1.3e410cp+0F, -0x1.6381f6p+1F, -0x1.ee3ee6p-7F},
    {0x1.3bc16ap+0F, -0x1.7293b4p+1F, -0x1.20235ep-5F},
    {0x1.3a8198p+0F, -0x1.7fc576p+1F, -0x1.2c0e0ep-6F},
}};

/// theta_hat after the trace.
inline constexpr ehsid::Array<float, Estimator::kN> kTraceTheta = {{
    -0x1.77b652p+0F,  // -1.46763
    0x1.1e7daep-2F,  // 0.279776
    0x1.d839eep-4F,  // 0.11529
    0x1.1ea3a6p-3F,  // 0.139961
    -0x1.af85e2p-2F,  // -0.421409
    0x1.2e903cp-2F,  // 0.295472
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
