// A bag of what the node says, complete from the first message on because the one who speaks writes it.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include <rosbag/bag.h>

#include "train_derail/files/output_file.hpp"
#include "train_derail/ros/message_sink.hpp"

namespace train_derail::ros_face {

/// All topics but /clock, which `rosbag play --clock` makes; received at their stamps, latched as the node latches
/// them. A disk that is full ends the recording, not the run.
class BagRecorder : public MessageSink {
 public:
  /// What happens only once: writes PATH.active, which becomes PATH when it is closed and is locked till then. Nothing
  /// that exists is written over, PATH or PATH.active: after a kill `rosbag reindex` makes the latter whole. `node`:
  /// name of the node whose topics these are, e.g. "/train_derail". Throws std::runtime_error that names the file if it
  /// cannot be opened or is being recorded by another process, files::ExistsError.
  BagRecorder(std::string path, std::string node);
  /// What can be had again: whole or not there, a kill leaves nothing. Throws std::runtime_error.
  BagRecorder(files::OutputFile file, std::string node);
  ~BagRecorder() override { close(); }
  /// Makes the bag whole. Afterwards error() says whether it is.
  void close();
  /// Gives up a recording into an OutputFile. Not after close().
  void discard();
  /// What has gone wrong first, with the file; empty if nothing. Nothing more is written then.
  const std::string& error() const { return error_; }
  const std::string& path() const { return path_; }

  bool wants_markers() const override { return true; }

 private:
  void begin(const std::string& name);
  void fail(const std::string& what);
  void receive(const AnyMessage& message) override;
  void unlock();

  const std::string path_, node_;
  std::optional<files::OutputFile> file_;
  int lock_ = -1;                     // descriptor of PATH.active, without a file_
  std::unique_ptr<rosbag::Bag> bag_;  // none once closed
  std::string error_;
  /// One header object a topic, in the order of Topics; made with the topic's first message.
  std::array<boost::shared_ptr<::ros::M_string>, kTopicCount> connections_;
};

/// `bag`: a file, or a folder, in which a new file named by date and time of day is meant.
std::string bag_path(const std::string& bag);

}  // namespace train_derail::ros_face
