#pragma once
// Visitors over the configuration for property tests: every key takes part without being named.
#include <chrono>
#include <random>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "daemon/app/config_field.hpp"

namespace embody::config::test {

/// Forwards what most visitors treat alike. `D` has value(key, member, range) and text(key, string).
template <class D>
class WalkingVisitor {
 public:
  void schema(int&, const char*) {}
  template <class T>
  void field(const char* key, T& value, const char*) {
    self().value(key, value, Range{});
  }
  template <class T>
  void field(const char* key, T& value, Range range, const char*) {
    self().value(key, value, range);
  }
  template <class E, class Names>
  void choice(const char* key, E& value, const Names& names, const char*) {
    int index = static_cast<int>(value);
    self().value(key, index, Range{0, static_cast<double>(names.size()) - 1});
    value = static_cast<E>(index);
  }
  void path(const char*, std::string&, const char*) {}
  void file_key(const char*, const char*) {}
  template <class T>
  void list(const char*, std::vector<T>&, const char*) {}
  template <class T>
  void section(const char*, T& value, const char*) {
    visit(self(), value);
  }
  template <class T>
  void merge(T& value) {
    visit(self(), value);
  }

 private:
  D& self() { return static_cast<D&>(*this); }
};

/// Gives every value a random one of its range, except those that must fit to each other.
class Randomiser : public WalkingVisitor<Randomiser> {
 public:
  explicit Randomiser(unsigned seed) : random_(seed) {}

  template <class T>
  void value(const std::string& key, T& member, Range range) {
    static const std::set<std::string> kFixed{"names",
                                              "shape",
                                              "back_edges_m",
                                              "top",
                                              "left",
                                              "right",
                                              "motors",
                                              "watchdog",
                                              "arm",
                                              "tracker",
                                              "hand",
                                              "fingers",
                                              "retry_first_ms",
                                              "retry_longest_ms",
                                              "hold_after_ms",
                                              "stop_after_ms",
                                              "motor_lower_rad",
                                              "motor_upper_rad",
                                              "joint_lower_rad",
                                              "joint_upper_rad",
                                              "workspace_min_m",
                                              "workspace_max_m"};
    if (kFixed.count(key) == 0) draw(member, range);
  }

 private:
  void draw(double& member, Range range) {
    member = std::uniform_real_distribution<double>(range.min, range.max)(random_);
  }
  void draw(int& member, Range range) {
    member = std::uniform_int_distribution<int>(static_cast<int>(range.min), static_cast<int>(range.max))(random_);
  }
  void draw(bool& member, Range) { member = random_() % 2 == 0; }
  template <class Rep, class Period>
  void draw(std::chrono::duration<Rep, Period>& member, Range range) {
    int count = 0;
    draw(count, range);
    member = std::chrono::duration<Rep, Period>(count);
  }
  void draw(std::string& member, Range) {
    static const std::string kLetters = "abcXYZ019 _-/\"\\'#=[]{}.,\xC3\xA4";
    member.clear();
    for (std::size_t i = random_() % 20; i > 0; --i) {
      const char letter = kLetters[random_() % (kLetters.size() - 2)];
      member += letter;
    }
    if (random_() % 4 == 0) member += "\xC3\xA4";  // two bytes of UTF-8
  }
  template <class T>
  requires requires(T& list) { list.begin(); }
  void draw(T& list, Range range) {
    if constexpr (requires { list.clear(); }) list.resize(random_() % 5);
    for (auto& item : list) draw(item, range);
  }

  std::mt19937 random_;
};

/// All values, in order.
class Collector : public WalkingVisitor<Collector> {
 public:
  template <class T>
  void value(const char*, T& member, Range) {
    take(member);
  }
  std::vector<double> numbers;
  std::vector<std::string> texts;

 private:
  template <class T>
  void take(const T& member) {
    if constexpr (std::is_arithmetic_v<T>) {
      numbers.push_back(static_cast<double>(member));
    } else if constexpr (std::is_same_v<T, std::string>) {
      texts.push_back(member);
    } else if constexpr (requires {
                           member.count();
                           member.zero();
                         }) {
      numbers.push_back(static_cast<double>(member.count()));
    } else {
      numbers.push_back(static_cast<double>(member.size()));
      for (const auto& item : member) take(item);
    }
  }
};

struct Key {
  std::string table;
  std::string name;
  Range range;
  bool whole{false};
  std::size_t length{0};  ///< of an array; 1 for a list of free length, 0 for a scalar
};

/// Names all keys of plain tables; `ranged` are the numbers among them.
class KeyLister {
 public:
  std::vector<Key> all;
  std::vector<Key> ranged;

  void schema(int&, const char*) {}
  template <class T>
  void field(const char* key, T&, const char*) {
    all.push_back({table_, key, {}, false, 0});
  }
  template <class T>
  void field(const char* key, T& value, Range range, const char*) {
    Key entry{table_, key, range, !std::is_floating_point_v<T>, 0};
    if constexpr (requires { value.begin(); }) {
      entry.whole = std::is_integral_v<std::decay_t<decltype(*value.begin())>>;
      entry.length = requires {
        value.push_back(0);
      }
      ? 1 : static_cast<std::size_t>(value.size());
    }
    all.push_back(entry);
    ranged.push_back(entry);
  }
  template <class E, class Names>
  void choice(const char* key, E&, const Names&, const char*) {
    all.push_back({table_, key, {}, false, 0});
  }
  void path(const char* key, std::string&, const char*) { all.push_back({table_, key, {}, false, 0}); }
  void file_key(const char*, const char*) {}
  template <class T>
  void list(const char* key, std::vector<T>&, const char*) {
    all.push_back({table_, key, {}, false, 0});
  }
  template <class T>
  void section(const char* key, T& value, const char*) {
    const std::string outer = table_;
    table_ = outer.empty() ? key : outer + "." + key;
    visit(*this, value);
    table_ = outer;
  }
  template <class T>
  void merge(T& value) {
    visit(*this, value);
  }

 private:
  std::string table_;
};

inline std::string number(double value, bool whole) {
  return whole ? std::to_string(static_cast<long long>(value)) : std::to_string(value);
}

/// TOML that assigns `value` to the key (to every entry of an array).
inline std::string assignment(const Key& key, const std::string& value) {
  std::string text = value;
  if (key.length > 0) {
    text = "[" + value;
    for (std::size_t i = 1; i < key.length; ++i) text += ", " + value;
    text += "]";
  }
  return "[" + key.table + "]\n" + key.name + " = " + text + "\n";
}

}  // namespace embody::config::test
