#pragma once

#include "dynamics/straight_line/composite_dynamics.hpp"

namespace redysim {

// Closed loops and rigid couplings at (q, qd) as rows over the joints. Row r requires residual 0, rate
// J_r qd = 0 and J_r qdd = -at_rest for qdd of the joints that are not prescribed. Rows without effect, for
// example those across the plane of a planar mechanism, are recognised by constant zeros.
struct JointRows {
  JointRows(const Plan<Recorded>& plan, Workspace<Recorded>& ws, const TreeEquations& tree, const Recorded* q,
            const Recorded* qd, const Recorded* inputs);

  RecordedMatrix J;               // rows x nv
  RecordedMatrix squared_bound;   // of the entries of J, from distances along the links
  std::vector<Recorded> at_rest;  // phi'' at qdd = 0 of the joints that are not prescribed
  std::vector<Recorded> residual, rate;
  std::vector<Recorded> residual_size, rate_size;  // magnitudes of their terms

 private:
  void set_loop(const Plan<Recorded>& plan, const Workspace<Recorded>& ws, const TreeEquations& tree,
                const LoopPlan<Recorded>& loop);
  void add_levers(const Plan<Recorded>& plan, const Workspace<Recorded>& ws, int row, Force<Recorded> wrench,
                  const Vec3<Recorded>& point, int body, int root);
  void set_coupling(const Plan<Recorded>& plan, const CouplingPlan& coupling, const Recorded* q,
                    const Recorded* qd, const Recorded* inputs);
};

// S = J M^-1 J^T of the rows with an effect, as L D L^T. Valid while each margin is positive: then no row is
// small or near dependence on others, and no decision on the rank is needed.
class JointRowFactor {
 public:
  JointRowFactor(const TreeEquations& tree, const JointRows& rows);
  const std::vector<Recorded>& margins() const { return margins_; }

  // qdd (nv), zero for prescribed joints, and multipliers lambda of the rows with an effect, for joint forces
  // tau:
  //   M qdd = tau - bias + J^T lambda
  struct Motion {
    std::vector<Recorded> qdd, lambda;
  };
  Motion motion(const Recorded* tau) const;
  // Drive force of prescribed joint i.
  Recorded prescribed_force(const Motion& motion, int i) const;
  // C = M^-1 J^T S^-1 (nv x rows): -C r is the change of q or qd with minimum norm in the mass metric that
  // cancels the residuals r to first order. Zero for rows without effect.
  RecordedMatrix corrections() const;

 private:
  void factorize();
  std::vector<Recorded> solved(std::vector<Recorded> b) const;  // S^-1 b
  bool has_effect(int row) const;
  // Motion for eliminated joint forces and the multipliers S^-1 b.
  Motion response(std::vector<Recorded> forces, std::vector<Recorded> b) const;

  const TreeEquations& tree_;
  const JointRows& rows_;
  std::vector<int> effective_;                // rows
  std::vector<std::vector<Recorded>> lever_;  // per effective row: L^-T J_r^T of the tree
  RecordedMatrix L_;                          // with D^-1 on the diagonal
  std::vector<Recorded> margins_;
};

}  // namespace redysim
