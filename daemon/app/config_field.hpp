#pragma once
// The vocabulary with which a configuration struct describes its keys. A struct has one member
//   template <class V> void visit(V& v)
// that calls, for each key and in the order in which people shall read them:
//   v.field(key, member, doc)              text, flags, lists
//   v.field(key, member, range, doc)       numbers, durations, arrays of numbers (the range holds for each element)
//   v.choice(key, member, names, doc)      an enumeration; names[i] belongs to the enumerator of value i
//   v.path(key, member, doc)               a file, found relative to the file that names it, then in the data folders
//   v.file_key(default, doc)               this table has a key `file`: a TOML file with keys of this same table
//   v.list(key, members, doc)              array of tables, each a struct with visit()
//   v.section(key, member, doc)            sub-table, a struct with visit()
//   v.schema(member, doc)                  the version number of the format, once
//   v.merge(member)                        the keys of another struct, in this same table
// Nothing else defines a key: parsing, printing and documentation are three visitors. A struct may also have
//   std::string problem() const            why the values do not fit together, or ""
// Key names end in their unit (`speed_m_s`); chrono members hold what the unit of their key says.
#include <chrono>

namespace embody::config {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr double kPi = 3.14159265358979323846;

/// Inclusive bounds of a number, in the unit of its key.
struct Range {
  double min{0.0};
  double max{0.0};
};

/// Visits `s` with its own visit(), or, for a struct of core, with the free visit_fields(v, s) found by its namespace.
template <class V, class T>
void visit(V& v, T& s) {
  if constexpr (requires { s.visit(v); }) {
    s.visit(v);
  } else {
    visit_fields(v, s);
  }
}

}  // namespace embody::config
