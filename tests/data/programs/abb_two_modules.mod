MODULE moves
  PROC main()
    VAR robtarget here;
    MoveJ pFar,v100,fine,tGun;
    here:=pFar;
    MoveL here,v100,fine,tGun;
    MoveL [[818.7,147.3,700+58.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tGun;
    MoveL pUnknown,v100,fine,tGun;
  ENDPROC
ENDMODULE
