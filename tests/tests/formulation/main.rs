//! From a model to its equations: diagnostics, hinge laws and forces, and the equations of motion
//! against independent formulations.

mod adjoint;
mod constrained;
mod contact_edges;
mod contacts;
mod controllers;
mod cuts;
mod derivatives;
mod elements;
mod energy;
mod examples;
mod family;
mod folds;
mod forces;
mod formulas;
mod free;
mod free_contacts;
mod hinges;
mod implicit;
mod leaving_flat;
mod motions;
mod near_flat;
mod newton_euler;
mod parameters;
mod patterns;
mod projections;
mod reference;
mod regressions;
mod robots;
mod sheets;
mod shrink;
mod size;
mod warnings;
mod wrong_inputs;
