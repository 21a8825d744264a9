#pragma once

#include <Eigen/Core>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

// A neutral scene in the text form of scenes.py for C++ programs: one word and its numbers per line.

namespace redysim::bench {

struct SceneText {
  struct Body {
    int parent = -1;
    std::string joint;  // revolute or prismatic, along z
    Eigen::Matrix3d rotation;
    Eigen::Vector3d position, com;
    double mass = 0, inertia[6] = {};  // xx yy zz xy xz yz about the center of mass
    double stiffness = 0, damping = 0, rest = 0, q = 0, qd = 0, tau = 0;
  };
  struct Tie {
    int a = -1, b = -1;  // -1: the ground
    Eigen::Vector3d point_a, point_b;
    double stiffness = 0, damping = 0, length = 0;  // springs only
  };
  Eigen::Vector3d gravity;
  std::vector<Body> bodies;
  std::vector<Tie> loops, springs;
  int rows = 0;
  double step = 0;

  explicit SceneText(const std::string& file) {
    std::ifstream in(file);
    const auto vector = [&in] {
      Eigen::Vector3d v;
      in >> v[0] >> v[1] >> v[2];
      return v;
    };
    for (std::string word; in >> word;) {
      if (word == "gravity") {
        gravity = vector();
      } else if (word == "rows") {
        in >> rows >> step;
      } else if (word == "body") {
        Body body;
        in >> body.parent >> body.joint;
        for (int i = 0; i < 9; ++i) in >> body.rotation(i / 3, i % 3);
        body.position = vector();
        in >> body.mass;
        body.com = vector();
        for (double& number : body.inertia) in >> number;
        in >> body.stiffness >> body.damping >> body.rest >> body.q >> body.qd >> body.tau;
        bodies.push_back(body);
      } else if (word == "loop" || word == "spring") {
        Tie tie;
        in >> tie.a;
        tie.point_a = vector();
        in >> tie.b;
        tie.point_b = vector();
        if (word == "spring") in >> tie.stiffness >> tie.damping >> tie.length;
        (word == "loop" ? loops : springs).push_back(tie);
      } else {
        throw std::runtime_error(file + ": unknown word " + word);
      }
      if (!in) throw std::runtime_error(file + ": numbers are missing after " + word);
    }
  }
};

}  // namespace redysim::bench
