#pragma once
// A user's own MANO files. Nothing of MANO comes with the product: get it, and its licence, at mano.is.tue.mpg.de.
#include <string>
#include <string_view>

#include "drivers/mano/mano_model.hpp"

namespace embody::mano {

/// Reads a model from the bytes of a file: JSON in the layout of dfki-ric/hand_embodiment or .npz as smplx uses it;
/// which one it is, the bytes tell. Bounded: see array_file.hpp. Errors: kMalformed; kUnsupported (too large, a
/// pickle).
[[nodiscard]] Result<ManoModel> parse_model(std::string_view bytes);

/// Reads a file of either kind. Errors: as parse_model() and kNotFound, kPermission, kIo; they name the file.
[[nodiscard]] Result<ManoModel> load_model(const std::string& path);

/// load_model() and hand_data(): what the daemon needs.
[[nodiscard]] Result<hand::HandData> load_hand(const std::string& path);

/// Writes format_model() to `path`, whole or not at all, and creates its folder. Errors: kRefused (`path` exists and
/// `overwrite` is false), kPermission, kIo.
[[nodiscard]] Status save_model(const ManoModel& model, const std::string& path, bool overwrite);

}  // namespace embody::mano
