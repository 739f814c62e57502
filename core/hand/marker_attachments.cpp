#include "core/hand/hand_model.hpp"

namespace embody::hand {

// Fitted, with a prior on nails and proximal phalanges, to a public recording of the 13-marker glove (dfki-ric/
// hand_embodiment, test/data/recording.tsv, BSD-3-Clause): this is where that glove carries its markers relative to
// these skeletons, not data of any hand model. Part of the offsets makes up for the difference between the skeleton and
// the subject's hand, e.g. the middle markers of ring and little finger, whose knuckles lie further out than the
// skeleton's.
MarkerAttachments default_attachments(Skeleton skeleton) noexcept {
  if (skeleton == Skeleton::kWebXr) {
    return {{{{{15, {.0111, -.0375, .0934}}, {14, {.0373, -.0201, .0806}}}},
             {{{3, {-.0779, .0077, .0279}}, {1, {-.0333, .0202, .0201}}}},
             {{{6, {-.0825, .0100, .0007}}, {4, {-.0248, .0223, -.0008}}}},
             {{{12, {-.0742, .0052, -.0255}}, {10, {-.0177, .0083, -.0340}}}},
             {{{9, {-.0444, .0013, -.0399}}, {7, {-.0063, -.0034, -.0480}}}}}};
  }
  return {{{{{15, {.0100, -.0241, .0942}}, {14, {.0385, -.0113, .0802}}}},
           {{{3, {-.0777, .0164, .0312}}, {1, {-.0319, .0260, .0204}}}},
           {{{6, {-.0851, .0179, .0054}}, {4, {-.0264, .0227, -.0005}}}},
           {{{12, {-.0767, .0161, -.0177}}, {10, {-.0216, .0093, -.0328}}}},
           {{{9, {-.0448, .0159, -.0398}}, {7, {-.0109, .0008, -.0490}}}}}};
}

}  // namespace embody::hand
