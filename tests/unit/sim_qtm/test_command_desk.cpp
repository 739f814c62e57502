#include "drivers/sim/qtm/command_desk.hpp"

#include <gtest/gtest.h>

namespace embody::sim {
namespace {

/// A QTM without sockets and any number of clients.
class Desk {
 public:
  explicit Desk(DeskConfig config = {}, bool playback = false, bool start_on_trigger = false)
      : measurement(playback, start_on_trigger, {"known.qtm"}, std::chrono::seconds(1)),
        desk(std::move(config), measurement, setup) {
    setup.rate_hz = 100.0;
    setup.labels = {"a", "b"};
    setup.axis = "+Z";
  }
  Conversation client(std::uint64_t id) {
    Conversation talk;
    talk.id = id;
    talk.peer = "127.0.0.1 (" + std::to_string(1000 + id) + ")";
    talk.minor_version = 25;
    return talk;
  }
  Answer ask(Conversation& talk, std::string_view command) {
    return desk.answer(talk, {static_cast<std::uint32_t>(Packet::kCommand), command}, TimePoint{});
  }
  /// The text of the reply, with "!" in front of an error, "-" for none and "event n" for an event.
  std::string say(Conversation& talk, std::string_view command) {
    last = ask(talk, command);
    if (!last.reply) return "-";
    if (const auto* event = std::get_if<QtmEvent>(&*last.reply)) {
      return "event " + std::to_string(static_cast<int>(*event));
    }
    const auto& reply = std::get<Reply>(*last.reply);
    return (reply.type == Packet::kError ? "!" : "") + reply.text;
  }
  std::vector<int> events() const {
    std::vector<int> ids;
    for (const QtmEvent event : last.events) ids.push_back(static_cast<int>(event));
    return ids;
  }
  QtmSetup setup;
  Measurement measurement;
  CommandDesk desk;
  Answer last;
};

using Ids = std::vector<int>;

TEST(CommandDesk, AcceptsVersions1_8To1_28AndNoOther) {
  Desk desk;
  Conversation talk = desk.client(1);
  for (int minor = 0; minor < 40; ++minor) {
    const std::string version = "1." + std::to_string(minor);
    const bool spoken = minor >= 8 && minor <= 28;
    EXPECT_EQ(desk.say(talk, "VERSION " + version), spoken ? "Version set to " + version : "!Version NOT supported");
  }
  for (const char* wrong : {"2.0", "1.", "1.25x", "25", "1.-8", "1.99999999999999999999"}) {
    EXPECT_EQ(desk.say(talk, std::string("Version ") + wrong), "!Version NOT supported");
  }
  EXPECT_EQ(desk.say(talk, "Version"), "Version is 1.28");
}

TEST(CommandDesk, AnswersWhateverTheCaseTheBlanksAndTheTerminator) {
  Desk desk;
  Conversation talk = desk.client(1);
  using namespace std::string_view_literals;
  for (const auto command : {"ByteOrder"sv, "byteorder"sv, "BYTEORDER  "sv, " ByteOrder\0"sv, "ByteOrder\0junk"sv}) {
    EXPECT_EQ(desk.say(talk, command), "Byte order is little endian");
  }
  talk.order = ByteOrder::kBig;
  EXPECT_EQ(desk.say(talk, "ByteOrder"), "Byte order is big endian");
  EXPECT_EQ(desk.say(talk, "QTMVersion"), "QTM Version is 2023.3 (build 13590)");
  for (const char* wrong : {"", "Fly", "ByteOrder now", "Quit", "GetParameters", "StreamFrames", "Version 1.25 1.24"}) {
    EXPECT_EQ(desk.say(talk, wrong), "!Parse error") << wrong;
  }
  EXPECT_TRUE(std::get<Reply>(*desk.desk.answer(talk, {3, "data"}, TimePoint{}).reply).text == "Parse error");
}

TEST(CommandDesk, ReadsEveryStreamTheDocumentAllows) {
  Desk desk;
  Conversation talk = desk.client(1);
  struct Case {
    const char* words;
    std::size_t divisor;
    std::size_t components;
  };
  for (const Case& c :
       {Case{"AllFrames 3D", 1, 1}, Case{"frequency:50 3d 3DRes", 2, 2}, Case{"Frequency:33 3D 3D", 3, 1},
        Case{"Frequency:1000 6D", 1, 1}, Case{"FrequencyDivisor:7 6DRes 6DEuler 6DEulerRes", 7, 3},
        Case{"AllFrames Analog:1,3-6 AnalogSingle:2 Force ForceSingle 2D 2DLin Image", 1, 7},
        Case{"AllFrames Skeleton:global Timecode GazeVector EyeTracker 3DNoLabels 3DNoLabelsRes", 1, 6},
        Case{"AllFrames UDP:4545 3D", 1, 1}, Case{"AllFrames udp:127.0.0.1:65535 3D", 1, 1}}) {
    talk.stream.reset();
    EXPECT_EQ(desk.say(talk, std::string("StreamFrames ") + c.words), "-") << "never acknowledged: " << c.words;
    ASSERT_TRUE(talk.stream.has_value()) << c.words;
    EXPECT_EQ(talk.stream->divisor, c.divisor) << c.words;
    EXPECT_EQ(talk.stream->components.size(), c.components) << c.words;
  }
  EXPECT_EQ(talk.stream->udp->address, "127.0.0.1");
  EXPECT_EQ(desk.say(talk, "streamframes STOP"), "-");
  EXPECT_FALSE(talk.stream.has_value());
}

TEST(CommandDesk, RefusesEveryOtherStreamAndKeepsThePresentOne) {
  Desk desk;
  Conversation talk = desk.client(1);
  ASSERT_EQ(desk.say(talk, "StreamFrames AllFrames 3D"), "-");
  for (const char* wrong : {"AllFrames",
                            "3D",
                            "Frequency:0 3D",
                            "Frequency:x 3D",
                            "Frequency: 3D",
                            "FrequencyDivisor:0 3D",
                            "FrequencyDivisor:-1 3D",
                            "AllFrames 7D",
                            "AllFrames 3D:1",
                            "AllFrames Analog:",
                            "AllFrames Analog:3-1",
                            "AllFrames Analog:1,,2",
                            "AllFrames Analog:0",
                            "AllFrames Skeleton:local",
                            "AllFrames UDP:1022 3D",
                            "AllFrames UDP:65536 3D",
                            "AllFrames UDP: 3D",
                            "AllFrames UDP::4000 3D",
                            "AllFrames UDP:4000",
                            "AllFrames All",
                            "Stop now"}) {
    EXPECT_EQ(desk.say(talk, std::string("StreamFrames ") + wrong), "!Parse error") << wrong;
    EXPECT_TRUE(talk.stream.has_value());
  }
}

TEST(CommandDesk, KnowsTheComponentsOfEachVersion) {
  const auto known = [](const char* component, int minor) {
    return parse_components({component}, 0, minor).has_value();
  };
  EXPECT_TRUE(known("Skeleton", 19));
  EXPECT_FALSE(known("Skeleton", 18));
  EXPECT_TRUE(known("EyeTracker", 21));
  EXPECT_FALSE(known("EyeTracker", 20));
  EXPECT_TRUE(known("Timecode", 17));
  EXPECT_FALSE(known("Timecode", 16));
  EXPECT_TRUE(known("All", 18));
  EXPECT_FALSE(known("All", 19));
  for (int minor = 8; minor <= 28; ++minor) EXPECT_TRUE(known("3DRes", minor) && known("6D", minor));
}

TEST(CommandDesk, RefusesDataBeforeAVersionIsSet) {
  Desk desk;
  Conversation talk = desk.client(1);
  talk.minor_version = 1;
  EXPECT_EQ(desk.say(talk, "StreamFrames AllFrames 3D"), "!Version NOT supported");
  EXPECT_EQ(desk.say(talk, "GetCurrentFrame 3D"), "!Version NOT supported");
  EXPECT_EQ(desk.say(talk, "Version"), "Version is 1.1");
}

TEST(CommandDesk, LetsOneClientBeMasterAtATime) {
  Desk desk({true, "Secret"});
  Conversation a = desk.client(1);
  Conversation b = desk.client(2);
  EXPECT_EQ(desk.say(a, "New"), "!You must be master to issue this command");
  EXPECT_EQ(desk.say(a, "ReleaseControl"), "You are already a regular client");
  EXPECT_EQ(desk.say(a, "TakeControl"), "!Wrong or missing password");
  EXPECT_EQ(desk.say(a, "TakeControl secret"), "!Wrong or missing password");
  EXPECT_EQ(desk.say(a, "takecontrol Secret"), "You are now master");
  EXPECT_EQ(desk.say(a, "TakeControl Secret"), "You are already master");
  EXPECT_EQ(desk.say(b, "TakeControl Secret"), "!127.0.0.1 (1001) is already master");
  EXPECT_EQ(desk.say(b, "Start"), "!You must be master to issue this command");
  desk.desk.forget(a);
  EXPECT_EQ(desk.say(b, "TakeControl Secret"), "You are now master") << "the master has left";
  EXPECT_EQ(desk.say(b, "ReleaseControl"), "You are now a regular client");
  Desk closed({false, ""});
  EXPECT_EQ(closed.say(a, "TakeControl"), "!Client control disabled in QTM");
}

TEST(CommandDesk, TakesSettingsFromTheMasterOnly) {
  Desk desk;
  Conversation talk = desk.client(1);
  const auto set = [&](std::string_view xml) {
    return std::get<Reply>(*desk.desk.answer(talk, {2, xml}, TimePoint{}).reply).text;
  };
  EXPECT_EQ(set("<QTM_Settings></QTM_Settings>"), "You must be master to issue this command");
  ASSERT_EQ(desk.say(talk, "TakeControl"), "You are now master");
  EXPECT_EQ(set("<QTM_Settings></QTM_Settings>"), "Setting parameters succeeded");
  EXPECT_EQ(set("<QTM_Settings>"), "Setting parameters failed");
}

/// A client that is master.
struct MasterDesk : Desk {
  explicit MasterDesk(bool playback = false, bool start_on_trigger = false) : Desk({}, playback, start_on_trigger) {
    talk = client(1);
    EXPECT_EQ(say("TakeControl"), "You are now master");
  }
  std::string say(std::string_view command) { return Desk::say(talk, command); }
  Conversation talk;
};

TEST(Measurement, CapturesSavesAndPlaysWithTheEventsOfQtm) {
  MasterDesk qtm;
  EXPECT_EQ(qtm.say("GetState"), "event 1");
  EXPECT_EQ(qtm.say("New"), "Already connected");
  EXPECT_EQ(qtm.say("Stop"), "!No measurement is running");
  EXPECT_EQ(qtm.say("SetQTMEvent grasp"), "!QTM is not capturing");
  EXPECT_EQ(qtm.say("Trig"), "!QTM not waiting for trig");
  EXPECT_EQ(qtm.say("Save x.qtm"), "!No measurement to save");
  EXPECT_EQ(qtm.say("Load known.qtm"), "!Active camera connection exists");
  EXPECT_EQ(qtm.say("Start"), "Starting measurement");
  EXPECT_EQ(qtm.events(), Ids{3});
  EXPECT_TRUE(qtm.measurement.running());
  EXPECT_EQ(qtm.say("Start"), "!Measurement is already running");
  EXPECT_EQ(qtm.say("SetQTMEvent grasp"), "Event set");
  EXPECT_EQ(qtm.say("Save x.qtm"), "!Failed to save measurement");
  EXPECT_EQ(qtm.say("Stop"), "Stopping measurement");
  EXPECT_EQ(qtm.events(), Ids{4});
  EXPECT_FALSE(qtm.measurement.running());
  EXPECT_EQ(qtm.say("New"), "!The previous measurement has not been saved or closed");
  EXPECT_EQ(qtm.say("Load known.qtm"), "!Current measurement not saved");
  EXPECT_EQ(qtm.say("Save known.qtm"), "Measurement saved as 'known.qtm_1'");
  EXPECT_EQ(qtm.events(), Ids{13});
  EXPECT_EQ(qtm.say("Save known.qtm Overwrite"), "Measurement saved");
  EXPECT_EQ(qtm.say("GetState"), "event 4") << "saving is no state";
  EXPECT_EQ(qtm.say("Start RTFromFile"), "Starting RT from file");
  EXPECT_EQ(qtm.events(), Ids{8});
  EXPECT_EQ(qtm.say("Start RTFromFile"), "!RT from file already running");
  EXPECT_EQ(qtm.say("Close"), "Closing file");
  EXPECT_EQ(qtm.events(), (Ids{9, 2}));
  EXPECT_EQ(qtm.say("GetState"), "event 2");
  EXPECT_EQ(qtm.say("GetParameters 3D"), "!Parameters not available");
  EXPECT_EQ(qtm.say("Start"), "!Not connected. Create connection with new");
  EXPECT_EQ(qtm.say("Close"), "!No connection to close");
  EXPECT_EQ(qtm.say("Start RTFromFile"), "!No file open");
  EXPECT_EQ(qtm.say("Load unknown.qtm"), "!Failed to load measurement");
  EXPECT_EQ(qtm.say("Load known.qtm"), "Measurement loaded");
  EXPECT_EQ(qtm.say("LoadProject p"), "Project loaded");
  EXPECT_EQ(qtm.say("New"), "Creating new connection");
  EXPECT_EQ(qtm.events(), Ids{1});
  EXPECT_EQ(qtm.say("Close"), "Closing connection");
}

TEST(Measurement, WaitsForItsTrigger) {
  MasterDesk qtm(false, /*start_on_trigger=*/true);
  EXPECT_EQ(qtm.say("Start"), "Starting measurement");
  EXPECT_EQ(qtm.events(), Ids{10});
  EXPECT_FALSE(qtm.measurement.running());
  EXPECT_EQ(qtm.say("GetState"), "event 10");
  EXPECT_EQ(qtm.say("Trig"), "Trig ok");
  EXPECT_EQ(qtm.events(), (Ids{16, 3}));
  EXPECT_EQ(qtm.say("GetState"), "event 3") << "the trigger is no state";
  EXPECT_TRUE(qtm.measurement.running());
}

TEST(Measurement, CalibratesForATimeAndIsThenConnectedAgain) {
  MasterDesk qtm;
  EXPECT_EQ(qtm.say("Calibrate refine"), "Starting calibration");
  EXPECT_EQ(qtm.events(), Ids{6});
  EXPECT_TRUE(qtm.last.calibration_asked);
  EXPECT_EQ(qtm.measurement.calibration_end(), TimePoint{} + std::chrono::seconds(1));
  EXPECT_EQ(qtm.say("GetState"), "event 6");
  EXPECT_EQ(qtm.measurement.end_calibration().events, std::vector{QtmEvent::kCalibrationStopped});
  EXPECT_FALSE(qtm.measurement.calibration_end());
  EXPECT_EQ(qtm.say("Start"), "Starting measurement");
}

TEST(Measurement, TellsThatItIsAPlaybackFromTheBeginning) {
  MasterDesk qtm(/*playback=*/true);
  EXPECT_EQ(qtm.say("GetState"), "event 8");
  EXPECT_EQ(qtm.measurement.begin().events, std::vector{QtmEvent::kPlaybackStarted});
  EXPECT_EQ(qtm.measurement.end().events, std::vector{QtmEvent::kPlaybackStopped});
  EXPECT_EQ(qtm.say("GetState"), "event 9");
}

TEST(Measurement, RefusesSurplusWords) {
  MasterDesk qtm;
  for (const char* wrong : {"New x", "Close x", "Start x", "Stop x", "Load", "Load a b", "Save", "Save a b", "Trig x",
                            "SetQTMEvent", "Calibrate x", "Save a Overwrite x"}) {
    EXPECT_EQ(qtm.say(wrong), "!Parse error") << wrong;
  }
}

}  // namespace
}  // namespace embody::sim
