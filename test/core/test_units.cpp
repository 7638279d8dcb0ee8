// Units: what is taken for what, what is refused and with which word, and that no prefix is taken that nobody means.
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail {
namespace {

std::string refusal(const std::string& text, const std::string& si_unit) {
  try {
    return "taken for " + std::to_string(inputs::to_si(text, si_unit));
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
}

TEST(UnitsMeant, AreConverted) {
  const struct {
    const char *text, *si_unit;
    double value;
  } cases[] = {{"90 km/h", "m/s", 25.0},
               {"90 km/hr", "m/s", 25.0},
               {"90 kph", "m/s", 25.0},
               {"90 km/hour", "m/s", 25.0},
               {"90 kilometers per hour", "m/s", 25.0},
               {"60 MPH", "m/s", 60 * inputs::kMph},
               {"60 mi/h", "m/s", 60 * inputs::kMph},
               {"60 miles per hour", "m/s", 60 * inputs::kMph},
               {"36 kt", "m/s", 18.52},
               {"10 ft/sec", "m/s", 3.048},
               {"10 m s-1", "m/s", 10.0},
               {"10 m.s^-1", "m/s", 10.0},
               {"17000 mm", "m", 17.0},
               {"33 in", "m", 0.8382},
               {"300 kip/in", "N/m", 300 * inputs::kKip / 0.0254},
               {"80 MN/m", "N/m", 8e7},
               {"2 1/km", "1/m", 0.002},
               {"5 ms", "s", 0.005},
               {"1.5 percent", "1", 0.015},
               {"0.1 mile", "m", 160.9344},
               {"7 yard", "m", 6.4008},
               {"850 kN", "N", 8.5e5},
               {"0.85 MN", "N", 8.5e5},
               {"85 daN", "N", 850.0},
               {"100 kgf", "N", 980.665},
               {"1 ton_force", "N", 2000 * inputs::kPoundForce},
               {"286 Kip", "N", 286 * inputs::kKip},
               {"1 kip/in", "N/m", inputs::kKip / 0.0254},
               {"5 kN/mm", "N/m", 5e6},
               {"2 kip*ft", "N m", 2 * inputs::kKip * inputs::kFoot},
               {"3 ft-lbf", "N m", 3 * inputs::kPoundForce * inputs::kFoot},
               {"3 lbf ft/deg", "N m/rad", 3 * inputs::kPoundForce * inputs::kFoot / inputs::kDegree},
               {"90 \u00b0", "rad", test::kPi / 2},
               {"10 mrad", "rad", 0.01},
               {"60 rpm", "rad/s", 2 * test::kPi},
               {"2 1/s", "rad/s", 2.0},
               {"4 deg/(100 ft)", "1/m", 4 * inputs::kDegree / (100 * inputs::kFoot)},
               {"2 km-1", "1/m", 0.002},
               {"3 kg m\u00b2", "kg m2", 3.0},
               {"3 kg\u00b7m^2", "kg m2", 3.0},
               {"3 kg m**2", "kg m2", 3.0},
               {"2 min", "s", 120.0},
               {"15 %", "1", 0.15},
               {"52.8 ft/mile", "1", 0.01},
               {".5 m", "m", 0.5},
               {"5. m", "m", 5.0},
               {"+1e-3m", "m", 1e-3},
               {"010", "1", 10.0}};
  for (const auto& c : cases) EXPECT_NEAR(inputs::to_si(c.text, c.si_unit), c.value, 1e-12 * c.value) << c.text;
}

// Common units are converted without UDUNITS, other names of the same units by it.
TEST(CommonUnits, AreReadAsUdunitsReadsThem) {
  const struct {
    const char *common, *other, *si_unit;
  } cases[] = {{"ft", "foot", "m"},           {"in", "inch", "m"},           {"mm", "millimeter", "m"},
               {"mph", "mile/hour", "m/s"},   {"km/h", "km/hour", "m/s"},    {"kip", "kips", "N"},
               {"kN", "kilonewton", "N"},     {"kip/in", "kip/inch", "N/m"}, {"MN/m", "MN/meter", "N/m"},
               {"lbf ft", "lbf foot", "N m"}, {"deg", "arc_degree", "rad"},  {"1/km", "km-1", "1/m"},
               {"percent", "%", "1"},         {"ms", "millisecond", "s"}};
  test::Random random(5);
  for (const auto& c : cases) {
    for (int i = 0; i < 200; ++i) {
      const std::string number = std::to_string(i < 100 ? 0.5 * i : random.uniform(0.0, 500.0)) + " ";
      EXPECT_EQ(inputs::to_si(number + c.common, c.si_unit), inputs::to_si(number + c.other, c.si_unit))
          << number << c.common;
    }
  }
}

// UDUNITS takes "kmph" for 1000 mph; every name here stands for a train a thousand times as fast, heavy or long, or for
// none.
TEST(UnitsNotMeant, NameTheOneThatProbablyIs) {
  const struct {
    const char *text, *si_unit, *probably;
  } cases[] = {{"90 kmph", "m/s", "km/h"},
               {"90 kmh", "m/s", "km/h"},
               {"90 Kmph", "m/s", "km/h"},
               {"90 KM/H", "m/s", "km/h"},
               {"90 kmphr", "m/s", "km/h"},
               {"60 mhp", "m/s", "mph"},
               {"60 mphs", "m/s", "mph"},
               {"60 mmph", "m/s", "mph"},
               {"10 mps", "m/s", "m/s"},
               {"10 fps", "m/s", "ft/s"},
               {"10 knt", "m/s", "knot"},
               {"286 Mkip", "N", "kip"},
               {"286 kkip", "N", "kip"},
               {"286 klb", "N", "kip"},
               {"286 klbs", "N", "kip"},
               {"286 kipp", "N", "kip"},
               {"5 Nm", "N m", "N m"},
               {"5 kNm", "N m", "kN m"},
               {"5 ftlb", "N m", "lbf ft"},
               {"5 ft-lbs.", "N m", "lbf ft"},
               {"5 ftlb", "N m/rad", "lbf ft/rad"},
               {"5 knm/rad", "N m/rad", "kN m/rad"},
               {"7 degg", "rad", "deg"}};
  for (const auto& c : cases) {
    const std::string text = c.text, unit = text.substr(text.find(' ') + 1);
    EXPECT_EQ(refusal(text, c.si_unit), "unknown unit '" + unit + "' (probably " + c.probably + ")") << text;
  }
}

TEST(UnitsNotMeant, PrefixesAreNotPutBeforeAnything) {
  for (const char* unit : {"kmile", "Mft", "kft", "Gm", "Pm", "Tm", "hm", "am", "fathomm", "kfathom", "dft", "mmile",
                           "cyard", "kin", "km2m"}) {
    EXPECT_NE(refusal("5 " + std::string(unit), "m").substr(0, 5), "taken") << unit;
  }
  for (const char* unit : {"klbf", "Mlbf", "kkgf", "Gkip", "mkip", "hN", "TN", "ktonf", "kdyn", "G", "M"}) {
    EXPECT_NE(refusal("5 " + std::string(unit), "N").substr(0, 5), "taken") << unit;
  }
  for (const char* unit : {"ks", "Ms", "kmin", "mmin", "kh", "m in", "G"})
    EXPECT_NE(refusal("5 " + std::string(unit), "s").substr(0, 5), "taken") << unit;
}

TEST(UnitsNotMeant, AMassIsNoWeight) {
  EXPECT_EQ(refusal("34 t", "N"), "a mass, but a weight is needed: 333 kN, 75 kip");
  EXPECT_EQ(refusal("34000 kg", "N"), "a mass, but a weight is needed: 333 kN, 75 kip");
  EXPECT_EQ(refusal("286000 lb", "N"), "a mass, but a weight is needed: 1272 kN, 286 kip");
  EXPECT_EQ(refusal("143 tons", "N"), "a mass, but a weight is needed: 1272 kN, 286 kip");
  EXPECT_EQ(refusal("5 lb/ft", "N/m"),
            "wrong dimension: 'lb/ft' cannot be converted to 'N/m': a mass instead of a force (write lbf, kgf or N, "
            "not lb or kg)");
  EXPECT_EQ(refusal("5 lbf ft2", "kg m2"),
            "wrong dimension: 'lbf ft2' cannot be converted to 'kg m2': a force instead of a mass (write lb or kg, "
            "not lbf, kgf or N)");
}

TEST(UnitsNotMeant, FeetAndInchesAreOneNumber) {
  for (const char* text : {"46 ft 6 in", "46ft 6in", "46' 6\"", "46'6", "46 feet 6 inches", "46 ft. 6 in."}) {
    const std::string answer = refusal(text, "m");
    EXPECT_EQ(answer, "feet and inches: write 46.5 ft") << text;
  }
  EXPECT_EQ(refusal("46'", "m"), "feet and inches: write 46 ft");
  EXPECT_EQ(refusal("6\"", "m"), "feet and inches: write 0.5 ft");
}

TEST(UnitsNotMeant, NumbersThatAreNone) {
  EXPECT_EQ(refusal("0,5", "m"), "a comma in a number: write a decimal point (0.5), and nothing between thousands");
  EXPECT_EQ(refusal("150,000 lbf", "N"),
            "a comma in a number: write a decimal point (0.5), and nothing between thousands");
  EXPECT_EQ(refusal("1_000", "m"), "an underscore in a number");
  EXPECT_EQ(refusal("0x1F", "m"), "a hexadecimal number");
  EXPECT_EQ(refusal("1 000 m", "m").substr(0, 25), "a second number in '000 m");
  EXPECT_EQ(refusal("37 mph 2", "m/s").substr(0, 15), "a second number");
  EXPECT_EQ(refusal("1e400 m", "m"), "number too large or too small");
  EXPECT_EQ(refusal("1e-400 m", "m"), "number too large or too small");
  EXPECT_EQ(refusal("1e307 km", "m"), "number too large or too small");
  for (const char* text : {"inf", "-inf", "infinity", "nan", "nan(7)"})
    EXPECT_EQ(refusal(text, "m").substr(0, 12), "not a finite") << text;
  for (const char* text : {"\uff13\uff17", "\u22123", "+-3", "-+3", "- 3", "mph", "+"})
    EXPECT_EQ(refusal(text, "m"), "not a number") << text;
}

TEST(UnitsNotMeant, CharactersOfNoUnit) {
  EXPECT_EQ(refusal("37\u00a0mph", "m/s"), "unit '\u00a0mph' has a character that no unit has (U+00A0)");
  EXPECT_EQ(refusal("37 mp\u0127", "m/s"), "unknown unit 'mp\u0127' (known: mph, km/h, ft/s, m/s, knot, ...)");
  for (const char* text : {"3 m @ 100", "3 m;", "3 m:", "3 m=", "3 m from 7", "3 (m", "3 m)", "3 m^", "3 m^99",
                           "3 m2.5", "3 lg(re 1 m)", "3 \x1b[31m", "3 \xff"}) {
    EXPECT_NE(refusal(text, "m").substr(0, 5), "taken") << text;
  }
}

TEST(UnitsNotMeant, AnglesAreNoRatios) {
  EXPECT_EQ(refusal("0.5 rad", "1"), "wrong dimension: 'rad' cannot be converted to '1': an angle");
  EXPECT_EQ(refusal("1 deg", "1"), "wrong dimension: 'deg' cannot be converted to '1': an angle");
  EXPECT_EQ(refusal("5 %", "rad"),
            "wrong dimension: '%' cannot be converted to 'rad': not an angle (known: deg, rad, ...)");
  EXPECT_EQ(refusal("1 Hz", "rad/s"),
            "wrong dimension: 'Hz' cannot be converted to 'rad/s': not an angle (known: rad/s, deg/s, rpm, ...)");
}

TEST(UnitsNotMeant, LongTextsAreCutInMessages) {
  EXPECT_LT(refusal("3 " + std::string(100000, 'q'), "m").size(), 400u);
  EXPECT_LT(refusal("3 " + std::string(100000, '('), "m").size(), 400u);
}

}  // namespace
}  // namespace train_derail
