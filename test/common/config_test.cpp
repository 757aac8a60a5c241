// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "common/config_json.h"

namespace ignis::config {
namespace {

struct Part {
  double width_m = 0.5;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("width_m", self.width_m, {0.1, 2.0}, "m", "width of the part");
  }
};

/// One field of each kind.
struct Machine {
  double speed = 1.5;
  int wheels = 4;
  bool armed = false;
  std::string name = "robot";
  std::string mode = "slow";
  std::array<double, 3> centre = {0.0, 1.0, 2.0};
  Part arm;
  std::vector<Part> parts;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("speed", self.speed, {0.0, 10.0}, "m/s", "speed over ground");
    visit.integer("wheels", self.wheels, {1, 8}, "1", "wheels on the ground");
    visit.flag("armed", self.armed, "may move");
    visit.text("name", self.name, "what people call it");
    visit.choice("mode", self.mode, {"slow", "fast"}, "gear");
    visit.vector("centre", self.centre, {-5.0, 5.0}, "m", "centre of mass");
    visit.section("arm", self.arm, "the arm");
    visit.list("parts", self.parts, 3, "spare parts");
  }
  void check(Offences& offences, const std::string& path) const {
    if (mode == "fast" && wheels < 3)
      offences.push_back({path + "wheels", std::to_string(wheels), "at least 3 when fast"});
  }
};

Machine load_text(const std::string& text) { return load<Machine>(parse_json(text, "test")); }

std::string refusal(const std::string& text) {
  try {
    (void)load_text(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Config, KeepsDefaultsForAbsentKeys) {
  const Machine machine = load_text(R"({"wheels": 6})");
  EXPECT_EQ(machine.wheels, 6);
  EXPECT_EQ(machine.speed, 1.5);
}

TEST(Config, PrintsAndLoadsBackEveryKindOfField) {
  Machine machine;
  machine.speed = 0.1;
  machine.armed = true;
  machine.mode = "fast";
  machine.centre = {0.25, -1.0, 3.0};
  machine.arm.width_m = 1.25;
  machine.parts = {Part{0.2}, Part{0.3}};
  const Json printed = Printer::print(machine);
  EXPECT_EQ(Printer::print(load<Machine>(printed)), printed);
  EXPECT_EQ(load<Machine>(printed).parts[1].width_m, 0.3);
}

TEST(Config, NamesEveryOffenceInOneMessage) {
  const std::string message =
      refusal(R"({"speed": 11, "wheels": 1.5, "armed": 1, "mode": "odd", "arm": {"width_m": 9}, "spede": 1})");
  for (const char* part : {"speed = 11", "0 to 10 [m/s]", "wheels = 1.5", "whole number from 1 to 8", "armed = 1",
                           "true or false", "mode = \"odd\"", "\"slow\" \"fast\"", "arm.width_m = 9", "0.1 to 2 [m]",
                           "spede = 1", "did you mean \"speed\"?", "6 faults"}) {
    EXPECT_NE(message.find(part), std::string::npos) << part << "\nnot in\n" << message;
  }
}

TEST(Config, RefusesNumbersThatAPlainConversionWouldBend) {
  EXPECT_NE(refusal(R"({"wheels": 4294967297})"), "");
  EXPECT_NE(refusal(R"({"wheels": -1})"), "");
  EXPECT_NE(refusal(R"({"wheels": true})"), "");
  EXPECT_NE(refusal(R"({"speed": "1"})"), "");
  EXPECT_NE(refusal(R"({"centre": [0, 1]})"), "");
  EXPECT_NE(refusal(R"({"centre": [0, 1, 99]})"), "");
}

TEST(Config, RefusesRulesAcrossFields) {
  EXPECT_NE(refusal(R"({"mode": "fast", "wheels": 2})").find("at least 3 when fast"), std::string::npos);
}

TEST(Config, RefusesTooManyListEntriesAndNamesTheBadOne) {
  EXPECT_NE(refusal(R"({"parts": [{}, {}, {}, {}]})").find("at most 3"), std::string::npos);
  EXPECT_NE(refusal(R"({"parts": [{}, {"width_m": 7}]})").find("parts[1].width_m = 7"), std::string::npos);
}

TEST(Config, RefusesDoubledKeysDeepNestingAndBrokenJson) {
  EXPECT_NE(refusal(R"({"wheels": 4, "wheels": 5})").find("line 1, column 22: the key \"wheels\" stands twice"),
            std::string::npos);
  EXPECT_NE(refusal("{\n  \"wheels\": 4,\n\n  \"wheels\": 5}").find("line 4, column 10: the key"), std::string::npos);
  EXPECT_NE(refusal(std::string(1000, '[')).find("line 1, column 18: nesting"), std::string::npos);
  EXPECT_NE(refusal("\n" + std::string(1000, '[')).find("line 2, column 18: nesting"), std::string::npos);
  EXPECT_NE(refusal("{\n  \"wheels\": ,\n}").find("line 2"), std::string::npos);
  EXPECT_NE(refusal("[1]").find("must be an object"), std::string::npos);
  EXPECT_NE(refusal(R"({"speed": NaN})"), "");
  EXPECT_NE(refusal(""), "");
}

TEST(Config, SaysWhyAFileCannotBeRead) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  EXPECT_THROW((void)read_json(folder / "no-such-file.json"), ConfigError);
  EXPECT_THROW((void)read_json(folder), ConfigError);
}

TEST(Config, SchemaStatesTypeRangeDefaultUnitAndMeaning) {
  const Json schema = SchemaWriter::schema(Machine{});
  EXPECT_EQ(schema["additionalProperties"], false);
  const Json& speed = schema["properties"]["speed"];
  EXPECT_EQ(speed["type"], "number");
  EXPECT_EQ(speed["maximum"], 10.0);
  EXPECT_EQ(speed["default"], 1.5);
  EXPECT_EQ(speed["description"], "speed over ground [m/s]");
  EXPECT_EQ(schema["properties"]["mode"]["enum"], Json::array({"slow", "fast"}));
  EXPECT_EQ(schema["properties"]["parts"]["items"]["properties"]["width_m"]["minimum"], 0.1);
}

TEST(Config, AssignmentsSetNestedValuesOfAnyKindAndNameWhatIsNone) {
  Json object = parse_json(R"({"a": {"b": 1, "kept": 2}})", "test");
  Offences offences;
  for (const char* assignment : {"a.b=2.5", "a.word=at_rest", "a.flag=true", "new.deep.list=[1, 2]", "top=\"=\""}) {
    assign(object, assignment, offences);
  }
  EXPECT_TRUE(offences.empty());
  EXPECT_EQ(object, parse_json(R"({"a": {"b": 2.5, "kept": 2, "word": "at_rest", "flag": true},
                                   "new": {"deep": {"list": [1, 2]}}, "top": "="})",
                               "test"));
  for (const char* wrong : {"a.b", "=1", "a..b=1", "a.b.c=1", "a.b=", ""}) assign(object, wrong, offences);
  EXPECT_EQ(offences.size(), 6U);
}

TEST(Config, ValidatorRefusesAStructThatWasFilledByHand) {
  Machine machine;
  machine.speed = std::nan("");
  EXPECT_THROW(require_valid(machine), ConfigError);
  machine.speed = 1.0;
  EXPECT_NO_THROW(require_valid(machine));
}

TEST(Config, NearestWordStaysSilentWhenNothingIsNear) {
  EXPECT_EQ(nearest_word("voxel_size", {"voxel_size_m", "speed"}), "voxel_size_m");
  EXPECT_EQ(nearest_word("zzzzzz", {"voxel_size_m", "speed"}), "");
}

}  // namespace
}  // namespace ignis::config
