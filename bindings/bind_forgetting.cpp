// SPDX-License-Identifier: MIT
// One Python class for each forgetting policy, made from what the policy says of itself.
#include "bindings.hpp"

#include <sstream>

namespace ehsid::bindings {
namespace {

struct ShownSetting {
  std::string name;    // in Python
  std::string member;  // in C++ and C
  std::string unit;
  std::string range;
  std::string meaning;
  double initial;  // the default
  int hil_place;
};

struct ShownPolicy {
  std::string id;
  py::object type;
  std::string summary;
  std::string source;
  std::uint32_t number;
  py::tuple settings;
};

/// The name in Python of a setting: `lambda` is a keyword there.
std::string python_name(const char* member) {
  const bool keyword = py::module_::import("keyword").attr("iskeyword")(member).cast<bool>();
  return std::string(member) + (keyword ? "_" : "");
}

/// "in (0, 1]", ">= 1"
std::string in_words(const Range& range) {
  std::ostringstream text;
  if (range.bounded) {
    text << "in " << (range.open ? '(' : '[') << range.minimum << ", " << range.maximum << ']';
  } else {
    text << (range.open ? "> " : ">= ") << range.minimum;
  }
  return text.str();
}

/// The settings of a policy, in its order.
template <class Policy>
std::vector<ShownSetting> shown_settings() {
  const Policy defaults;
  std::vector<ShownSetting> shown;
  Policy::settings([&](const SettingInfo& setting, auto member) {
    shown.push_back({python_name(setting.name), setting.name, setting.unit, in_words(setting.range),
                     setting.meaning, member(defaults), setting.hil_place});
  });
  return shown;
}

template <class Policy>
std::string show(const SettingValues& values) {
  std::string text = Policy::kInfo.type;
  const char* before = "(";
  std::size_t at = 0;
  for (const ShownSetting& setting : shown_settings<Policy>()) {
    text += before + setting.name + "=" + py::repr(py::float_(values[at++])).cast<std::string>();
    before = ", ";
  }
  return text + ")";
}

/// ValueError that names the setting unless every value is in its range.
template <class Policy>
void check(const SettingValues& values) {
  std::size_t at = 0;
  Policy::settings([&](const SettingInfo& setting, auto /*member*/) {
    if (!setting.range.contains(values[at++])) {
      throw py::value_error(show<Policy>(values) + ": " + python_name(setting.name) +
                            " must be finite and " + in_words(setting.range));
    }
  });
}

template <class Policy>
constexpr std::size_t count_settings() {
  std::size_t count = 0;
  Policy::settings([&](const SettingInfo& /*setting*/, auto /*member*/) { ++count; });
  return count;
}

/// A double for each setting.
template <std::size_t>
using Given = double;

template <std::size_t kPlace, std::size_t... kSettings>
void bind_init(py::class_<PolicySettings<kPlace>>& cls, const std::vector<ShownSetting>& settings,
               std::index_sequence<kSettings...> /*settings*/) {
  using Policy = typename PolicySettings<kPlace>::Policy;
  cls.def(py::init([](Given<kSettings>... given) {
            PolicySettings<kPlace> made{{given...}};
            check<Policy>(made.values);
            return made;
          }),
          (py::arg(settings[kSettings].name.c_str()) = settings[kSettings].initial)...);
}

/// Does P lose the weight of the start from the first sample on, because it is divided by a factor?
template <std::size_t kPlace>
bool forgets_the_start(const PolicySettings<kPlace>& settings) {
  using Policy = typename PolicySettings<kPlace>::Policy;
  Policy policy;
  std::size_t at = 0;
  Policy::settings(
      [&](const SettingInfo& /*setting*/, auto member) { member(policy) = settings.values[at++]; });
  policy.restart();
  return policy.loss() > 0.0;
}

template <std::size_t kPlace>
py::object bind_policy(py::module_& m) {
  using Settings = PolicySettings<kPlace>;
  using Policy = typename Settings::Policy;
  const std::vector<ShownSetting> settings = shown_settings<Policy>();
  std::string text = std::string("Forgetting policy: ") + Policy::kInfo.summary +
                     ".\n\nSource: " + Policy::kInfo.source + ".\n\nParameters\n----------\n";
  for (const ShownSetting& setting : settings) {
    text += setting.name + " : float " + setting.range + "\n    " + setting.meaning + ".\n";
  }
  text += "\nRaises\n------\nValueError\n    Where an argument is outside its range.";

  py::class_<Settings> cls(m, Policy::kInfo.type, text.c_str());
  bind_init(cls, settings, std::make_index_sequence<count_settings<Policy>()>{});
  for (std::size_t at = 0; at < settings.size(); ++at) {
    cls.def_property_readonly(settings[at].name.c_str(),
                              [at](const Settings& self) { return self.values[at]; });
  }
  cls.def_property_readonly("forgets_the_start", &forgets_the_start<kPlace>,
                            "True where the covariance is divided by a factor from the first "
                            "sample on, so that an estimate to start from soon counts for little.");
  cls.def("__repr__", [](const Settings& self) { return show<Policy>(self.values); });
  const py::object shown =
      py::cast(ShownPolicy{Policy::kInfo.id, cls, Policy::kInfo.summary, Policy::kInfo.source,
                           Policy::kId, py::tuple(py::cast(settings))});
  cls.attr("info") = shown;
  return shown;
}

void bind_descriptions(py::module_& m) {
  py::class_<ShownSetting>(m, "PolicySetting", "A setting of a forgetting policy, in words.")
      .def_readonly("name", &ShownSetting::name, "Argument and property in Python.")
      .def_readonly("member", &ShownSetting::member, "Member in C++ and C.")
      .def_readonly("unit", &ShownSetting::unit, "\"1\" for a pure number.")
      .def_readonly("range", &ShownSetting::range, "e.g. \"in (0, 1]\"; values are finite.")
      .def_readonly("meaning", &ShownSetting::meaning)
      .def_readonly("default", &ShownSetting::initial)
      .def_readonly("hil_place", &ShownSetting::hil_place,
                    "Which of the numbers of `configure` carries it, docs/hil_protocol.md.")
      .def("__repr__", [](const py::object& self) { return show_properties(self, {"name"}); });
  py::class_<ShownPolicy>(m, "PolicyInfo", "A forgetting policy, in words.")
      .def_readonly("id", &ShownPolicy::id, "Name in C and in files.")
      .def_readonly("policy", &ShownPolicy::type, "Class of the policy.")
      .def_readonly("summary", &ShownPolicy::summary)
      .def_readonly("source", &ShownPolicy::source)
      .def_readonly("number", &ShownPolicy::number,
                    "Number in snapshots, from 1 on; one less is its number in the HIL protocol.")
      .def_readonly("settings", &ShownPolicy::settings, "Tuple of PolicySetting.")
      .def("__repr__", [](const py::object& self) { return show_properties(self, {"id"}); });
}

}  // namespace

void bind_forgetting(py::module_& m) {
  bind_descriptions(m);
  py::list all;
  for_each_policy([&](auto place) { all.append(bind_policy<place.value>(m)); });
  py::object any = all[0].attr("policy");
  for (std::size_t place = 1; place < all.size(); ++place) {
    any = any.attr("__or__")(all[place].attr("policy"));
  }
  m.attr("Forgetting") = any;
  m.attr("HIL_PLACES") = kHilPlaces;
  m.def(
      "policies", [policies = py::tuple(all)] { return policies; },
      "All forgetting policies: a tuple of PolicyInfo, in the order of their numbers.");
}

}  // namespace ehsid::bindings
