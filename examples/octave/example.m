% The index finger along a motion: its torques by the kernel, and again from the mass matrix and what is left at rest.
q = [0.05; 0.4; 0.6; 0.3];
g = [0; 0; -9.81];
qdd = [10; -20; 30; 40];
still = zeros(4, 1);

M = awiwi_mex("index_mass_matrix", q);
tau = awiwi_mex("index_inverse_dynamics", q, still, qdd, g);
rest = awiwi_mex("index_inverse_dynamics", q, still, still, g);
printf("torques [N m]:%s\n", sprintf(" %.6f", tau));
printf("off M qdd + gravity by %.1e of the largest\n", max(abs(M * qdd + rest - tau)) / max(abs(tau)));
